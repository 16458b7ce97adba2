// What was done in a step, what was weighed for it, what a person noted, and what became of the objects.

class StoryPanel {
  constructor(common, episode, letter, goTo) {
    Object.assign(this, { common, episode, letter, goTo });
    this.now = make("div", {});
    const { story } = episode;
    const facts = story.facts.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]);
    const said = [story.description, ...this.leftOut(), story.recording_left_out].filter(Boolean);
    if (!story.has_truth) said.push(`${common.no_truth[0].toUpperCase()}${common.no_truth.slice(1)}: nothing tells how right the belief is.`);
    this.root = make("div", { class: "of-episode" }, this.now, make("section", { class: "about" }, make("h3", {}, "About this episode"),
      ...said.map((words) => make("p", {}, words)), make("dl", {}, ...facts)));
  }

  leftOut() {
    const { story, last } = this.episode;
    const said = [];
    if (last < story.budget) said.push(`The episode is not finished: ${last} of ${story.budget} actions are done.`);
    if (story.every > 1) {
      said.push(`To keep this page short it holds the beliefs and images of every ${ordinal(story.every)} step only; between them the last one stays. Scores and decisions are of all steps.`);
    }
    return said;
  }

  draw(step) {
    const { episode } = this;
    const at = Math.min(step, episode.last);
    const moment = episode.story.moments[at];
    const parts = [make("h2", {}, `${this.letter}Step ${at} of ${episode.story.budget}`)];
    if (step > episode.last) parts.push(make("p", { class: "weak" }, `This episode ends after step ${episode.last}.`));
    if (moment.note) parts.push(make("p", { class: "note" }, make("b", {}, "Note: "), moment.note));
    if (moment.kind) parts.push(...this.decision(moment));
    else parts.push(make("p", {}, "Before the first action nothing is known of the shelf."));
    parts.push(...this.verdicts(moment), ...this.notes(at));
    this.now.replaceChildren(...parts);
  }

  decision(moment) {
    const parts = [make("p", { class: "action" }, moment.action), make("p", {}, `because ${moment.because}`)];
    if (moment.mishaps.length) parts.push(make("ul", { class: "mishaps" }, ...moment.mishaps.map((words) => make("li", {}, words))));
    parts.push(make("h3", {}, "What was weighed, nats"), this.bars(moment.terms), make("p", { class: "weak" }, moment.margin));
    if (moment.candidates.length || moment.drawn) {
      const rows = moment.candidates.map(({ words, gain, value, mark }) => [words, figure(gain), figure(value), mark]);
      if (rows.length) parts.push(make("h3", {}, "Best manipulations"), table(["what", "gain", "value", ""], rows, 3));
      parts.push(make("p", { class: "weak" }, moment.drawn));
    }
    if (moment.views.length) {
      const best = Math.max(...moment.views.map(([, gain]) => gain), 1e-9);
      const rows = moment.views.map(([view, gain, word]) => [`view ${view}`, figure(gain), `${Math.round((100 * gain) / best)} %`, word]);
      parts.push(make("h3", {}, "Best views"), table(["", "gain", "of best", ""], rows, 3));
    }
    return parts;
  }

  bars(terms) {
    const most = Math.max(1e-9, ...terms.map(({ nats }) => Math.abs(nats)));
    const stops = this.common.cividis;
    const rows = terms.map(({ name, nats, words, decides, shade }) =>
      make("div", { class: decides ? "bar decides" : "bar", title: words }, make("span", {}, name),
        make("span", { class: "track" }, make("i", { style: `width:${(100 * Math.abs(nats)) / most}%;background:${stops[Math.round(63 * shade)]}` })),
        make("span", { class: "number" }, figure(nats))));
    return make("div", { class: "bars" }, ...rows);
  }

  verdicts({ verdicts }) {
    if (!verdicts.length) return [];
    const parts = [make("h3", {}, "Objects"), make("p", {}, verdicts.map(([verdict, names]) => `${names.length} ${verdict}`).join(" · "))];
    for (const [verdict, names] of verdicts) {
      parts.push(make("details", { open: verdict !== "found" }, make("summary", {}, `${verdict} (${names.length})`), make("p", { class: "names" }, names.join(", "))));
    }
    if (verdicts.some(([, names]) => names.some((name) => name.endsWith("*")))) parts.push(make("p", { class: "weak" }, "* judged by a person"));
    return parts;
  }

  notes(now) {
    const noted = this.episode.story.moments.map(({ note }, at) => [note, at]).filter(([note, at]) => note && at !== now);
    if (!noted.length) return [];
    const items = noted.map(([note, at]) =>
      make("li", {}, make("button", { class: "link", onclick: () => this.goTo(at) }, `Step ${at}`), ` ${note}`));
    return [make("h3", {}, "Notes on other steps"), make("ul", { class: "notes" }, ...items)];
  }
}

function ordinal(number) {
  const ending = [11, 12, 13].includes(number % 100) ? "th" : ["th", "st", "nd", "rd"][number % 10] ?? "th";
  return `${number}${ending}`;
}

// A table; the row whose last cell says so is marked.
function table(titles, rows, markAt) {
  const head = make("tr", {}, ...titles.map((title) => make("th", { scope: "col" }, title)));
  const body = rows.map((cells) => make("tr", { class: cells[markAt] === "chosen" ? "chosen" : null }, ...cells.map((cell) => make("td", {}, cell))));
  return make("table", {}, make("thead", {}, head), make("tbody", {}, ...body));
}
