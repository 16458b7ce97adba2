//! What the text of a source file says of modules: its children, what it imports, and every path that it names.

/// A path that a file names.
pub struct Named {
    /// The path, as written.
    pub path: Vec<String>,
    /// The name that the file knows it by from then on: only of imports.
    pub name: Option<String>,
    /// Whether others may name it here: `pub use`.
    pub is_reexport: bool,
    /// Number of modules without a file of their own around it.
    pub inside: usize,
}

/// A source file.
pub struct File {
    /// The modules that it declares as files of their own, those of tests left out.
    pub children: Vec<String>,
    /// What it names.
    pub named: Vec<Named>,
    /// Its words and signs, those of tests left out; strings in their quotes.
    pub tokens: Vec<String>,
}

impl File {
    /// Reads a file's text.
    pub fn of(text: &str) -> Self {
        let tokens = without_tests(tokens(text));
        let mut reader = Reader { tokens: &tokens, at: 0, children: Vec::new(), named: Vec::new() };
        reader.items();
        let Reader { children, named, .. } = reader;
        Self { children, named, tokens }
    }

    /// Whether the code has these words and signs in a row.
    pub fn says(&self, words: &[String]) -> bool {
        self.tokens.windows(words.len()).any(|window| window == words)
    }
}

/// The words and signs of a text, without comments, characters and lifetimes; `::` is one sign, and so is a string with its
/// quotes.
pub fn tokens(text: &str) -> Vec<String> {
    let chars: Vec<char> = text.chars().collect();
    let (mut tokens, mut at) = (Vec::new(), 0);
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let look = |at: usize| chars.get(at).copied().unwrap_or('\0');
    while at < chars.len() {
        let c = chars[at];
        if c == '/' && look(at + 1) == '/' {
            while at < chars.len() && chars[at] != '\n' {
                at += 1;
            }
        } else if c == '/' && look(at + 1) == '*' {
            while at < chars.len() && !(chars[at] == '*' && look(at + 1) == '/') {
                at += 1;
            }
            at += 2;
        } else if c == 'r' && (look(at + 1) == '"' || look(at + 1) == '#' && matches!(look(at + 2), '"' | '#')) {
            let from = at;
            let hashes = chars[at + 1..].iter().take_while(|c| **c == '#').count();
            at += hashes + 2;
            let ends = |at: usize| {
                chars[at] == '"' && chars[at + 1..].iter().take(hashes).filter(|c| **c == '#').count() == hashes
            };
            while at < chars.len() && !ends(at) {
                at += 1;
            }
            at += hashes + 1;
            tokens.push(chars[from..at.min(chars.len())].iter().collect());
        } else if c == '"' {
            let from = at;
            at += 1;
            while at < chars.len() && chars[at] != '"' {
                at += if chars[at] == '\\' { 2 } else { 1 };
            }
            at += 1;
            tokens.push(chars[from..at.min(chars.len())].iter().collect());
        } else if c == '\'' {
            // A character, or a lifetime.
            if look(at + 1) == '\\' {
                at += 3;
                while at < chars.len() && chars[at] != '\'' {
                    at += 1;
                }
                at += 1;
            } else if look(at + 2) == '\'' {
                at += 3;
            } else {
                at += 1;
                while is_word(look(at)) {
                    at += 1;
                }
            }
        } else if is_word(c) {
            let from = at;
            while is_word(look(at)) {
                at += 1;
            }
            tokens.push(chars[from..at].iter().collect());
        } else if c == ':' && look(at + 1) == ':' {
            tokens.push("::".to_owned());
            at += 2;
        } else {
            if !c.is_whitespace() {
                tokens.push(c.to_string());
            }
            at += 1;
        }
    }
    tokens
}

/// Leaves out every item that stands behind `#[cfg(test)]`.
fn without_tests(tokens: Vec<String>) -> Vec<String> {
    let is_test =
        |at: usize| tokens[at..].iter().take(7).map(String::as_str).eq(["#", "[", "cfg", "(", "test", ")", "]"]);
    let (mut kept, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        if is_test(at) {
            at = end_of_item(&tokens, at + 7);
        } else {
            kept.push(tokens[at].clone());
            at += 1;
        }
    }
    kept
}

/// Where an item ends that begins at `at`: behind its semicolon, or behind its braces.
fn end_of_item(tokens: &[String], mut at: usize) -> usize {
    let mut depth = 0;
    while at < tokens.len() {
        let word = tokens[at].as_str();
        depth += i32::from(matches!(word, "{" | "(" | "[")) - i32::from(matches!(word, "}" | ")" | "]"));
        at += 1;
        if depth == 0 && matches!(word, ";" | "}") {
            break;
        }
    }
    at
}

struct Reader<'a> {
    tokens: &'a [String],
    at: usize,
    children: Vec<String>,
    named: Vec<Named>,
}

impl Reader<'_> {
    fn look(&self, ahead: usize) -> &str {
        self.tokens.get(self.at + ahead).map_or("", String::as_str)
    }

    fn items(&mut self) {
        // At each open brace, whether it is that of a module.
        let mut braces: Vec<bool> = Vec::new();
        let mut is_public = false;
        while self.at < self.tokens.len() {
            let inside = braces.iter().filter(|is_module| **is_module).count();
            let (word, next) = (self.look(0).to_owned(), self.look(1).to_owned());
            match word.as_str() {
                "pub" => {
                    is_public = true;
                    self.at += 1;
                    if self.look(0) == "(" {
                        self.skip_brackets();
                    }
                    continue;
                }
                "mod" if self.look(2) == ";" => {
                    self.children.push(next);
                    self.at += 3;
                }
                "mod" if self.look(2) == "{" => {
                    braces.push(true);
                    self.at += 3;
                }
                "use" => {
                    self.at += 1;
                    self.tree(&[], is_public, inside);
                }
                "{" | "}" => {
                    if word == "{" {
                        braces.push(false);
                    } else {
                        braces.pop();
                    }
                    self.at += 1;
                }
                _ if is_name(&word)
                    && next == "::"
                    && (self.at == 0 || !matches!(self.tokens[self.at - 1].as_str(), "::" | ".")) =>
                {
                    let mut path = vec![word];
                    self.at += 1;
                    while self.look(0) == "::" && is_name(self.look(1)) {
                        path.push(self.look(1).to_owned());
                        self.at += 2;
                    }
                    self.named.push(Named { path, name: None, is_reexport: false, inside });
                }
                _ => self.at += 1,
            }
            is_public = false;
        }
    }

    /// Passes what stands in brackets.
    fn skip_brackets(&mut self) {
        while !matches!(self.look(0), ")" | "") {
            self.at += 1;
        }
        self.at += 1;
    }

    /// Reads what follows `use`, or one branch of it.
    fn tree(&mut self, before: &[String], is_reexport: bool, inside: usize) {
        let mut path = before.to_vec();
        loop {
            let word = self.look(0).to_owned();
            if word == "{" {
                self.at += 1;
                while !matches!(self.look(0), "}" | "") {
                    self.tree(&path, is_reexport, inside);
                    if self.look(0) == "," {
                        self.at += 1;
                    }
                }
                self.at += 1;
                return;
            }
            self.at += 1;
            // `use a::{self, b}` names `a`.
            if (path.is_empty() || word != "self") && word != "::" {
                path.push(word);
            }
            if self.look(0) != "::" && !matches!(self.tokens[self.at - 1].as_str(), "::") {
                break;
            }
        }
        let mut name = path.last().cloned();
        if self.look(0) == "as" {
            name = Some(self.look(1).to_owned());
            self.at += 2;
        }
        self.named.push(Named { path, name, is_reexport, inside });
    }
}

fn is_name(word: &str) -> bool {
    word.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_')
}
