// The page of a stream: gauges, alarms and the last ten minutes, as the server tells them.
"use strict";

(() => {
  const KEPT = 2400; // gauges that are kept, as the server does
  const DRAWN = 500; // time between two drawings [ms]
  const QUIET = 10; // time without rows after which the numbers are called old, and step in which it is told [s]
  const HEIGHT = 190; // of a chart [px]
  const UNITS = {
    _rad_s: ["rpm", 30 / Math.PI],
    _m_s: ["mm/s", 1e3],
    _m: ["mm", 1e3],
    _pa: ["bar", 1e-5],
    _v: ["V", 1],
  };
  const holder = document.querySelector(".live-stream");
  const gauges = holder.querySelector(".gauges");
  const histories = document.querySelector(".histories");
  const state = document.querySelector(".live-state");
  const alarms = document.querySelector(".alarms tbody");
  const todo = document.querySelector(".alarm-todo");
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const digits = (value) => (value === null || value === undefined ? "–" : Number(value.toPrecision(4)).toString().replace("-", "−"));
  const clock = (seconds) => new Date(1000 * seconds).toLocaleString("sv"); // 2026-11-28 06:16:32, as in file names
  const quiet = document.querySelector(".live-quiet");
  const charts = new Map();
  let received = null; // when the latest gauges were, by this browser's clock [ms]
  let streaming = false;
  let silent = false; // no row has arrived for a while
  let told = null; // the state, as the server told it last
  let lost = false; // the server does not answer
  let points = [];
  let dirty = false;

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  function unitOf(channel) {
    const ending = Object.keys(UNITS).sort((a, b) => b.length - a.length).find((one) => channel.endsWith(one));
    const [unit, factor] = ending ? UNITS[ending] : ["", 1];
    const words = (ending ? channel.slice(0, -ending.length) : channel).replaceAll("_", " ");
    return { words: words.replace(/ [ab]$/, (chamber) => chamber.toUpperCase()), unit, factor };
  }

  const BALANCES = { loss: "lost flow" }; // the others are a balance of what they are called after
  const balanceWords = (balance) => BALANCES[balance] ?? `${balance} balance`;

  const share = (point, balance) => {
    const [score, threshold] = [point.scores[balance], point.thresholds[balance]];
    return threshold ? (100 * score) / threshold : null;
  };

  function showQuiet() {
    const seconds = received === null ? 0 : QUIET * Math.floor((performance.now() - received) / (1000 * QUIET));
    quiet.hidden = !streaming || seconds < QUIET;
    const words = seconds < 120 ? `${seconds} s` : `${Math.round(seconds / 60)} min`;
    const said = quiet.hidden ? "" : `No row has arrived for ${words}: the numbers below are old, and nothing is watched.`;
    if (quiet.textContent !== said) quiet.textContent = said;
    if (silent === quiet.hidden && told !== null && !lost) {
      silent = !quiet.hidden;
      showState(told);
    }
  }

  function showState(one) {
    told = one;
    lost = false;
    streaming = ["learning", "watching"].includes(one.state);
    const said = one.message.startsWith(one.state) ? one.message : [one.state, one.message].filter(Boolean).join(": ");
    const raised = one.events.filter((event) => event.event === "alarm");
    const last = raised.at(-1);
    const count = raised.length === 1 ? "1 alarm" : `${raised.length} alarms`;
    const before = last ? `${count}, the last at ${clock(last.received)}: ${last.message}. ` : "";
    const watching = last && one.state === "watching" ? "Watching" : said;
    const now = silent && streaming ? "Waiting for rows" : watching;
    const again = ["failed", "ended"].includes(one.state) ? " It is tried again every few seconds." : "";
    state.textContent = `${before}${now[0].toUpperCase()}${now.slice(1)}.${again}`;
    state.classList.toggle("alarmed", raised.length > 0);
    todo.hidden = !raised.length;
    const rows = one.events.toReversed().map((event) =>
      element(
        "tr",
        {},
        element("th", { scope: "row", class: "date" }, clock(event.received)),
        element("td", { class: "number", "data-head": "time [s]" }, digits(event.time_s)),
        element("td", { "data-head": "event", class: event.event === "alarm" ? "bad" : "" }, event.event),
        element("td", { "data-head": "message" }, event.message ?? ""),
      ),
    );
    alarms.replaceChildren(...rows);
  }

  function tile(words, value, unit, more) {
    return element("li", {}, element("strong", {}, `${value}${unit ? ` ${unit}` : ""}`), words, element("br"), element("small", {}, more));
  }

  function showGauges(point) {
    const tiles = Object.keys(point.values).map((channel) => {
      const { words, unit, factor } = unitOf(channel);
      const ends = [point.low[channel], point.high[channel]].map((one) => (one === undefined ? "–" : digits(factor * one)));
      return tile(words, digits(point.values[channel] === null ? null : factor * point.values[channel]), unit, `last quarter second: ${ends[0]} to ${ends[1]}${unit ? ` ${unit}` : ""}`);
    });
    for (const balance of Object.keys(point.scores)) {
      const part = share(point, balance);
      const [value, unit] = part === null ? ["learning", ""] : [digits(Math.round(part)), "%"];
      const left = Math.ceil(point.unlearnt_s ?? 0);
      const more = part === null && left ? `alarms are possible after ${left}\u00a0s more of motion` : "an alarm is raised at 100 %";
      tiles.push(tile(`${balanceWords(balance)}: how close to an alarm`, value, unit, more));
    }
    tiles.push(tile("rows", point.rows.toLocaleString("en"), "", `${point.gaps} gaps, ${point.left_out} left out, ${digits(point.time_s)}\u00a0s`));
    gauges.replaceChildren(...tiles);
  }

  function chart(label, unit, two) {
    const known = charts.get(label);
    if (known) return known;
    const figure = element("figure", {}, element("figcaption", {}, unit ? `${label} [${unit}]` : label));
    histories.append(figure);
    const line = { stroke: css("blue"), width: 1, points: { show: false } };
    const axis = { stroke: css("soft"), grid: { stroke: css("line"), width: 1 }, space: 20 };
    const share = { range: (_, least, most) => [0, Math.max(110, most ?? 0)] }; // up to an alarm, at the least
    const alarm = { stroke: css("bad"), width: 1, dash: [6, 4], points: { show: false } };
    const made = new uPlot(
      {
        width: figure.clientWidth || 320,
        height: HEIGHT,
        legend: { show: false },
        cursor: { show: false },
        scales: { x: { time: false }, y: two ? {} : share },
        axes: [{ ...axis, space: 60, label: "time of the stream [s]", labelSize: 18, labelFont: "12px sans-serif" }, { ...axis, size: 64, values: (_, ticks) => ticks.map(digits) }],
        series: two ? [{}, line, line] : [{}, line, alarm],
        bands: two ? [{ series: [2, 1], fill: `${css("blue")}44` }] : [],
      },
      [[], [], []],
      figure,
    );
    charts.set(label, made);
    new ResizeObserver(() => made.setSize({ width: figure.clientWidth, height: HEIGHT })).observe(figure);
    return made;
  }

  function draw() {
    if (!dirty || !points.length || document.hidden) return;
    dirty = false;
    const last = points.at(-1);
    showGauges(last);
    const times = points.map((one) => one.time_s);
    for (const channel of Object.keys(last.values)) {
      const { words, unit, factor } = unitOf(channel);
      const ends = ["low", "high"].map((end) => points.map((one) => (one[end][channel] === undefined ? null : factor * one[end][channel])));
      chart(words, unit, true).setData([times, ...ends]);
    }
    for (const balance of Object.keys(last.scores)) {
      const shares = points.map((one) => share(one, balance));
      if (shares.every((one) => one === null)) continue; // it is learnt still
      chart(`${balanceWords(balance)}: how close to an alarm`, "%", false).setData([times, shares, times.map(() => 100)]);
    }
    document.documentElement.classList.add("live-drawn");
  }

  const usable = (point) => Object.keys(point.values).length > 0;
  const source = new EventSource(`../api/streams/${holder.dataset.name}/events`);
  source.addEventListener("history", (event) => {
    const told = JSON.parse(event.data);
    points = told.history.filter(usable);
    if (points.length) received = performance.now() - 1000 * Math.max(0, (told.now ?? points.at(-1).received) - points.at(-1).received);
    dirty = true;
    showState(told);
    draw();
  });
  source.addEventListener("gauges", (event) => {
    const point = JSON.parse(event.data);
    if (!usable(point)) return;
    received = performance.now();
    if (points.length && point.time_s < points.at(-1).time_s) points = []; // the stream began again
    points.push(point);
    if (points.length > KEPT) points.shift();
    dirty = true;
  });
  source.addEventListener("state", (event) => showState(JSON.parse(event.data)));
  source.addEventListener("error", () => {
    lost = true;
    state.textContent = "The server does not answer; the view continues when it does.";
  });
  setInterval(() => {
    showQuiet();
    draw();
  }, DRAWN);
})();
