// The clock: buttons, a slider, marks for manipulations and notes, and what was done in words.

class Clock {
  constructor(page) {
    this.page = page;
    const button = (text, title, action) => make("button", { title, "aria-label": title, onclick: action }, text);
    this.playing = button("▶", "Play", () => this.play());
    this.slider = make("input", { type: "range", id: "step", min: 0, max: page.last, step: 1, "aria-label": "Step", oninput: (event) => page.goTo(+event.target.value) });
    this.words = make("p", { class: "words", "aria-live": "polite" });
    const track = make("div", { class: "track" }, this.slider, make("div", { class: "marks" }, ...this.marks()));
    document.getElementById("clock").append(
      make("div", { class: "keys" }, button("|◀◀", "First step", () => page.goTo(0)), button("|◀", "Step back", () => page.goTo(page.state.step - 1)),
        this.playing, button("▶|", "Step forward", () => page.goTo(page.state.step + 1)), button("▶▶|", "Last step", () => page.goTo(page.last))),
      track, this.words, make("p", { class: "weak help", title: KEYS }, "Keys: ← → step · space plays · C L T R [ ]"));
  }

  marks() {
    const { episodes, last } = this.page;
    const at = (step) => `left:${(100 * step) / Math.max(1, last)}%`;
    return episodes.flatMap((episode, which) => episode.story.moments.flatMap(({ kind, note, action }, step) => {
      const found = [];
      if (kind && kind !== "look") found.push(make("span", { class: `mark of-${which}`, style: at(step), title: `Step ${step}: ${action}` }, "▲"));
      if (note) found.push(make("span", { class: `mark note-mark of-${which}`, style: at(step), title: `Note on step ${step}` }, "✎"));
      return found;
    }));
  }

  draw() {
    const { state, episodes, last } = this.page;
    this.slider.value = state.step;
    const said = episodes.map((episode, which) => {
      const moment = episode.story.moments[state.step];
      const words = !moment ? "has ended" : moment.kind ? moment.action : "nothing is done yet";
      return episodes.length > 1 ? `${"AB"[which]}: ${words}` : words;
    });
    const words = `Step ${state.step} of ${last} · ${said.join(" · ")}`;
    this.words.textContent = words;
    this.slider.setAttribute("aria-valuetext", words);
  }

  play() {
    const { page } = this;
    if (this.timer) {
      clearInterval(this.timer);
      this.timer = null;
    } else {
      if (page.state.step >= page.last) page.goTo(0);
      this.timer = setInterval(() => {
        if (page.state.step >= page.last) this.play();
        else page.goTo(page.state.step + 1);
      }, 900);
    }
    this.playing.textContent = this.timer ? "❚❚" : "▶";
    this.playing.setAttribute("aria-label", this.timer ? "Pause" : "Play");
    this.playing.title = this.timer ? "Pause" : "Play";
  }
}
