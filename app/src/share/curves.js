// Score curves over the steps: of A as full lines, of B dashed. A click moves the clock.

const PLOT = { left: 46, right: 12, top: 8, bottom: 24 };

// Round numbers from 0 to at least `most`.
function ticksTo(most) {
  const rough = Math.max(most, 1e-6) / 4;
  const size = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((factor) => factor * size).find((value) => value >= rough);
  return Array.from({ length: Math.ceil(most / step - 1e-9) + 1 }, (_, at) => at * step);
}

const short = (value) => (value >= 10000 ? `${+(value / 1000).toFixed(1)}k` : `${+value.toFixed(3)}`);

class Chart {
  constructor(series, top, episodes, goTo) {
    Object.assign(this, { series, episodes, goTo });
    this.ticks = ticksTo(top);
    this.legend = make("p", { class: "legend" });
    this.plot = svg("svg", { class: "plot", role: "img", "aria-label": `${series.map(({ title }) => title).join(", ")} over the steps` });
    this.plot.addEventListener("click", (event) => {
      const share = (event.offsetX - PLOT.left) / Math.max(1, this.plot.clientWidth - PLOT.left - PLOT.right);
      goTo(Math.round(share * this.last));
    });
    this.root = make("figure", { class: "chart" }, this.legend, this.plot);
  }

  get last() {
    return Math.max(1, ...this.episodes.map((episode) => episode.last));
  }

  draw(step, theme) {
    // First what takes room beside the plot.
    this.legend.replaceChildren(...this.words(step, theme));
    const [width, height] = [Math.max(160, this.plot.clientWidth), Math.max(90, this.plot.clientHeight)];
    this.plot.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const top = this.ticks.at(-1);
    const x = (at) => PLOT.left + ((width - PLOT.left - PLOT.right) * at) / this.last;
    const y = (value) => height - PLOT.bottom - ((height - PLOT.top - PLOT.bottom) * value) / top;
    const parts = [];
    for (const tick of this.ticks) {
      parts.push(svg("line", { class: "hair", x1: x(0), x2: x(this.last), y1: y(tick), y2: y(tick) }));
      parts.push(svg("text", { x: PLOT.left - 6, y: y(tick) + 4, "text-anchor": "end" }, short(tick)));
    }
    const every = [1, 2, 5, 10, 20, 50].find((number) => (x(number) - x(0)) >= 22) ?? 50;
    for (let at = 0; at <= this.last; at += every) {
      parts.push(svg("text", { x: x(at), y: height - 6, "text-anchor": "middle" }, `${at}`));
    }
    this.episodes.forEach((episode, which) => {
      episode.story.moments.forEach(({ kind }, at) => {
        if (!kind || kind === "look") return;
        const [cx, cy] = [x(at), height - PLOT.bottom - 2 - 9 * which];
        parts.push(svg("path", { class: "move", d: `M${cx - 4} ${cy}h8l-4 -7z` }, svg("title", {}, `${kind} in step ${at}`)));
      });
      for (const { at, rgb } of this.series) {
        const places = episode.story.moments.map(({ scores }, n) => (scores[at] === null ? null : `${x(n).toFixed(1)} ${y(Math.min(scores[at], top)).toFixed(1)}`));
        const d = `M${places.filter(Boolean).join("L")}`;
        parts.push(svg("path", { class: "curve", d, stroke: lineColour(rgb, theme.isLight), "stroke-dasharray": which ? "6 4" : "none" }));
      }
    });
    parts.push(svg("line", { class: "now", x1: x(step), x2: x(step), y1: PLOT.top, y2: height - PLOT.bottom }));
    this.plot.replaceChildren(...parts);
  }

  words(step, theme) {
    const value = (episode, at) => figure(episode.story.moments[Math.min(step, episode.last)].scores[at]);
    const named = this.episodes.length > 1;
    const words = this.series.map(({ at, title, hint, rgb }) =>
      make("span", { class: "swatch line", title: hint },
        make("i", { style: `background:${lineColour(rgb, theme.isLight)}` }), `${title} `,
        ...this.episodes.flatMap((episode, which) => [named ? ` ${"AB"[which]} ` : "", make("b", {}, value(episode, at))])));
    const kinds = new Set(this.episodes.flatMap((episode) => episode.story.moments.map(({ kind }) => kind)));
    const moves = [...kinds].filter((kind) => kind && kind !== "look");
    if (moves.length) words.push(make("span", { class: "weak" }, `▲ ${moves.join(", ")}`));
    if (named) words.push(make("span", { class: "weak" }, "A full, B dashed"));
    return words;
  }
}

// The charts that the episodes have numbers for: what lies between 0 and 1, and the entropy.
function chartsOf(common, episodes, goTo) {
  const series = common.series.map(([key, title, hint, colour], at) => ({ key, title, hint, at, rgb: rgbOf(colour) }));
  const values = ({ at }) => episodes.flatMap((episode) => episode.story.moments.map(({ scores }) => scores[at])).filter((value) => value !== null);
  const shares = series.filter(({ key }) => ["occupancy_iou", "occupied_iou", "semantic_miou"].includes(key));
  const entropy = series.filter(({ key }) => key === "entropy_nats");
  const charts = [];
  if (shares.some((one) => values(one).length)) charts.push(new Chart(shares, 1, episodes, goTo));
  charts.push(new Chart(entropy, Math.max(...entropy.flatMap(values)), episodes, goTo));
  return charts;
}
