//! The other program: started, asked in turn, and ended.

use super::WorldSettings;
use super::wire::{Answer, Asked, Reply, Request};
use crate::{Error, Result};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// An answer is not longer than this, bytes; images are files.
const LONGEST: u64 = 16 << 20;
/// How long a program that is told to end may take.
const GRACE: Duration = Duration::from_secs(2);

/// A program that answers line by line.
pub(super) struct Program {
    child: Child,
    input: Option<ChildStdin>,
    /// Locked by nobody else: an environment may be looked at from several threads.
    answers: Mutex<Receiver<std::result::Result<String, String>>>,
    timeout: Duration,
    next: u64,
    /// What ended the conversation.
    ended: Option<String>,
}

impl Program {
    pub(super) fn start(settings: &WorldSettings) -> Result<Self> {
        let fail = |words: String| Error::Usage(format!("the world `{}` {words}", settings.command));
        let mut shell = if cfg!(windows) { Command::new("cmd") } else { Command::new("sh") };
        shell.arg(if cfg!(windows) { "/C" } else { "-c" }).arg(&settings.command);
        // A group of its own, so that what the shell started ends with it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut shell, 0);
        let started = shell.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let mut child = started.map_err(|error| fail(format!("does not start: {error}")))?;
        let (input, output) = (child.stdin.take(), child.stdout.take());
        let output = output.ok_or_else(|| fail("has no output".to_owned()))?;
        // A program that talks without being asked is heard no further than this.
        let (to, answers) = sync_channel(4);
        std::thread::spawn(move || {
            let mut output = BufReader::new(output);
            loop {
                let mut line = Vec::new();
                let read = output.by_ref().take(LONGEST).read_until(b'\n', &mut line);
                let heard = match read {
                    Ok(0) | Err(_) => break,
                    Ok(count) if count as u64 == LONGEST => Err(format!("answers more than {LONGEST} bytes in a line")),
                    Ok(_) => String::from_utf8(line).map_err(|_| "answers what is no text".to_owned()),
                };
                let is_broken = heard.is_err();
                if to.send(heard).is_err() || is_broken {
                    break;
                }
            }
            // Its output stays open until it is ended, so that it does not complain of a closed pipe first.
            let _ = std::io::copy(&mut output, &mut std::io::sink());
        });
        let timeout = Duration::from_secs_f64(settings.timeout_s);
        Ok(Self { child, input, answers: Mutex::new(answers), timeout, next: 0, ended: None })
    }

    /// Asks and waits for the answer. After an error every further call is one.
    pub(super) fn ask(&mut self, asked: Asked, what: &str) -> Result<Answer> {
        if let Some(why) = &self.ended {
            return Err(Error::Usage(format!("the world is gone: it {why}")));
        }
        let id = self.next;
        let answers = self.answers.get_mut().unwrap_or_else(PoisonError::into_inner);
        // A program that speaks as it starts is taken at its word: what it said answers the first request.
        if id > 0
            && let Ok(heard) = answers.try_recv()
        {
            let line = heard.unwrap_or_default();
            return Err(self.fail(&format!("spoke without being asked, or answered twice: {}", shortened(&line))));
        }
        self.next += 1;
        let mut line =
            serde_json::to_string(&Request { id, asked }).map_err(|error| Error::Usage(error.to_string()))?;
        line.push('\n');
        // Where it no longer listens, what it said last tells more than a closed pipe: the answer is waited for all the same.
        let _ = self.input.as_mut().map(|input| input.write_all(line.as_bytes()).and_then(|()| input.flush()));
        let line = match self.answers.get_mut().unwrap_or_else(PoisonError::into_inner).recv_timeout(self.timeout) {
            Ok(Ok(line)) => line,
            Ok(Err(words)) => return Err(self.fail(&words)),
            Err(RecvTimeoutError::Timeout) => {
                let words = format!("did not answer within {} s ({what})", self.timeout.as_secs_f64());
                return Err(self.fail(&words));
            }
            Err(RecvTimeoutError::Disconnected) => {
                let why = self.how_it_ended(what);
                return Err(self.fail(&why));
            }
        };
        let reply: Reply = match serde_json::from_str(&line) {
            Ok(reply) => reply,
            Err(error) => {
                let words = format!("answered what is no answer ({error}): {}", shortened(&line));
                return Err(self.fail(&words));
            }
        };
        if reply.id != id {
            let words = format!("answered request {} where {id} was asked", reply.id);
            return Err(self.fail(&words));
        }
        match reply.answer {
            Answer::Error(words) => {
                let words = format!("reports an error ({what}): {}", shortened(&words));
                Err(self.fail(&words))
            }
            answer => Ok(answer),
        }
    }

    /// The error of an answer to another question.
    pub(super) fn wrong(&mut self, expected: &str, answer: &Answer) -> Error {
        self.fail(&format!("answered `{}` where `{expected}` was due", answer.name()))
    }

    /// Ends the conversation.
    pub(super) fn fail(&mut self, words: &str) -> Error {
        let words = words.replace(['\n', '\r'], " ");
        self.ended.get_or_insert_with(|| words.clone());
        self.end(Duration::ZERO);
        Error::Usage(format!("the world {words}"))
    }

    fn how_it_ended(&mut self, what: &str) -> String {
        std::thread::sleep(Duration::from_millis(50));
        match self.child.try_wait() {
            Ok(Some(status)) => format!("ended ({what}): {status}"),
            _ => format!("closed its output ({what})"),
        }
    }

    /// Waits so long for the program to end, and then ends it.
    fn end(&mut self, grace: Duration) {
        self.input = None;
        let until = Instant::now() + grace;
        while Instant::now() < until && matches!(self.child.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(10));
        }
        if matches!(self.child.try_wait(), Ok(None)) {
            #[cfg(unix)]
            let _ = rustix::process::kill_process_group(
                rustix::process::Pid::from_child(&self.child),
                rustix::process::Signal::KILL,
            );
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        if self.ended.is_none() {
            if let Ok(mut line) = serde_json::to_string(&Request { id: self.next, asked: Asked::End {} }) {
                line.push('\n');
                let _ = self.input.as_mut().map(|input| input.write_all(line.as_bytes()).and_then(|()| input.flush()));
            }
            self.end(GRACE);
        }
    }
}

fn shortened(line: &str) -> String {
    let line = line.trim();
    let short: String = line.chars().take(120).collect();
    let more = if short.len() < line.len() { "..." } else { "" };
    format!("{}{more}", short.replace(['\n', '\r'], " "))
}
