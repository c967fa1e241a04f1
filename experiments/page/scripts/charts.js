// Charts of a page: each figure of class "charts" holds its numbers as JSON and a picture that stands for them until
// they are drawn, on paper, and where scripts do not run. Charts of one group share their x axis and cursor.
"use strict";

(() => {
  const MISSING = -32768;
  const HEIGHT = { wide: 190, narrow: 150 };
  const NARROW = 560;
  const STEP = 0.002; // share of the shown range by which an arrow key moves the cursor
  const groups = new Map();

  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  // A data: URL would be a request; bytes are decoded here and inflated by the browser.
  function bytesOf(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Response(stream).arrayBuffer();
  }

  async function unpacked(curve) {
    const steps = new Int16Array(await bytesOf(curve.data));
    let at = 0;
    return Array.from(steps, (step) => {
      at = (at + step) << 16 >> 16; // differences wrap as 16-bit numbers do
      return at === MISSING ? null : curve.middle + curve.quantum * at;
    });
  }

  async function abscissa(x) {
    const places = x.data ? await unpacked(x) : Array.from({ length: x.count }, (_, i) => x.start + x.step * i);
    return x.log ? places.map((one) => 10 ** one) : places;
  }

  const digits = (value) => (value === null || value === undefined ? "–" : Number(value.toPrecision(5)).toString());

  const dateOf = (day) => new Date(Math.round(864e5 * day)).toISOString().slice(0, 10); // of days since 1970-01-01

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  function button(words, act) {
    const made = element("button", { type: "button" }, words);
    made.addEventListener("click", act);
    return made;
  }

  function marks(panel) {
    return (chart) => {
      const { ctx, bbox } = chart;
      ctx.save();
      ctx.strokeStyle = css("bad");
      ctx.fillStyle = css("bad");
      ctx.lineWidth = devicePixelRatio;
      ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
      ctx.textBaseline = "alphabetic";
      ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
      for (const mark of panel.marks) {
        const across = mark.axis === "y";
        const at = chart.valToPos(mark.at, mark.axis, true);
        const [first, last] = across ? [bbox.top, bbox.top + bbox.height] : [bbox.left, bbox.left + bbox.width];
        if (!(at >= first && at <= last)) continue;
        ctx.beginPath();
        ctx.moveTo(across ? bbox.left : at, across ? at : bbox.top);
        ctx.lineTo(across ? bbox.left + bbox.width : at, across ? at : bbox.top + bbox.height);
        ctx.stroke();
        const before = across || at + 4 + ctx.measureText(mark.words).width > last; // no room behind a late mark
        ctx.textAlign = before ? "right" : "left";
        const place = across ? bbox.left + bbox.width - 4 : before ? at - 4 : at + 4;
        ctx.fillText(mark.words, place, across ? at - 4 : bbox.top + 14 * devicePixelRatio);
      }
      ctx.restore();
    };
  }

  function series(curve) {
    const look = { label: curve.name, stroke: css(curve.colour), width: 1.3, spanGaps: false, pxAlign: 0, points: { show: false } };
    if (curve.look === "dots") return { ...look, paths: () => null, points: { show: true, size: 6, fill: css(curve.colour) } };
    if (curve.look === "edge") return { ...look, width: 0.6 };
    return look;
  }

  const scaleOf = (x) => (x.log ? { time: false, distr: 3, range: (_, low, high) => [low, high] } : { time: false });

  // Options of one panel; axes take their colours from the page, so that dark pages have dark figures.
  function optionsOf(panel, figure, width, last) {
    const axis = { stroke: css("soft"), grid: { stroke: css("line"), width: 1 }, ticks: { stroke: css("line"), width: 1 } };
    const bands = panel.bands.map(([upper, lower]) => ({ series: [upper + 1, lower + 1], fill: `${css("accent")}33` }));
    return {
      width,
      height: (width < NARROW ? HEIGHT.narrow : HEIGHT.wide) + (last ? 36 : 0),
      legend: { show: false },
      padding: [10, figure.x.dates ? 38 : 24, last ? 0 : 8, 0], // room for half of the last date, and of the lowest number where no axis is below it
      cursor: { sync: { key: figure.group }, drag: { x: true, y: false } },
      scales: { x: scaleOf(figure.x), y: panel.ends ? { range: () => panel.ends } : {} },
      axes: [
        {
          ...axis, label: last ? figure.x.label : undefined, show: last, size: 34, labelSize: 20,
          ...(figure.x.dates ? { space: 84, incrs: figure.x.dates, values: (_, ticks) => ticks.map(dateOf) } : {}),
        },
        { ...axis, size: 62 },
      ],
      series: [{}, ...panel.curves.map(series)],
      bands,
      hooks: {
        draw: [marks(panel)],
        setScale: [(chart, key) => key === "x" && share(chart, figure.group)],
        setCursor: [(chart) => show(chart)],
      },
    };
  }

  let sharing = false;

  function share(chart, group) {
    if (sharing) return;
    sharing = true;
    const { min, max } = chart.scales.x;
    for (const other of groups.get(group) ?? []) if (other !== chart) other.setScale("x", { min, max });
    sharing = false;
  }

  function show(chart) {
    const at = chart.cursor.idx;
    chart.legendValues?.forEach((cell, i) => {
      cell.textContent = at === null || at === undefined ? "" : ` ${digits(chart.data[i + 1][at])}`;
    });
    if (chart.placeOf) chart.placeOf.textContent = at === null || at === undefined ? "" : chart.placeWords(at);
  }

  function legendOf(chart, panel) {
    const row = element("div", { class: "legend" }, element("span", { class: "measure" }, `${panel.label} [${panel.unit}]`));
    chart.legendValues = panel.curves.map((curve, i) => {
      const value = element("span", { class: "value" });
      const swatch = element("span", { class: `swatch ${curve.colour}`, "aria-hidden": "true" });
      const toggle = button("", () => {
        const on = toggle.getAttribute("aria-pressed") !== "true";
        toggle.setAttribute("aria-pressed", String(on));
        chart.setSeries(i + 1, { show: on });
      });
      toggle.setAttribute("aria-pressed", "true");
      toggle.append(swatch, curve.name, value);
      row.append(toggle);
      return value;
    });
    return row;
  }

  const rangeOf = (values) => {
    let low = Infinity;
    let high = -Infinity;
    for (const value of values) {
      if (value === null) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return [low, high];
  };

  function zoom(group, factor, shift = 0) {
    const [first] = groups.get(group);
    const log = first.scales.x.distr === 3;
    const [along, back] = log ? [Math.log10, (one) => 10 ** one] : [Number, Number];
    const whole = [first.data[0][0], first.data[0].at(-1)].map(along);
    const [min, max] = [first.scales.x.min, first.scales.x.max].map(along);
    const half = (0.5 * (max - min)) / factor;
    const under = first.cursor.idx;
    const middle = shift === 0 && under !== null && under !== undefined && factor > 1
      ? along(first.data[0][under])
      : 0.5 * (min + max) + shift * (max - min);
    const low = Math.max(whole[0], Math.min(middle - half, whole[1] - 2 * half));
    first.setScale("x", { min: back(low), max: back(Math.min(whole[1], low + 2 * half)) });
  }

  const reset = (group) => {
    const [first] = groups.get(group);
    first.setScale("x", { min: first.data[0][0], max: first.data[0].at(-1) });
  };

  function keys(chart, group) {
    const acts = {
      ArrowLeft: () => step(chart, -1), ArrowRight: () => step(chart, 1),
      "+": () => zoom(group, 2), "=": () => zoom(group, 2), "-": () => zoom(group, 0.5),
      PageUp: () => zoom(group, 1, -0.5), PageDown: () => zoom(group, 1, 0.5),
      0: () => reset(group), Escape: () => reset(group),
    };
    return (event) => {
      const act = acts[event.key];
      if (!act || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      act();
    };
  }

  function step(chart, direction) {
    const { min, max } = chart.scales.x;
    const width = chart.over.clientWidth;
    const now = chart.cursor.left < 0 ? 0.5 * width : chart.cursor.left;
    const left = Math.min(Math.max(now + direction * Math.max(1, STEP * width), 0), width - 1);
    if (max > min) chart.setCursor({ left, top: 0.5 * chart.over.clientHeight }, true);
  }

  function csvOf(x, panels) {
    const columns = panels.flatMap((panel) => panel.values);
    const quoted = (words) => `"${words.replaceAll('"', '""')}"`;
    const heads = panels.flatMap((panel) => panel.curves.map((curve) => quoted(`${panel.label} ${curve.name} [${panel.unit}]`)));
    const lines = [[quoted(panels.abscissa), ...heads].join(",")];
    for (let i = 0; i < x.length; i++) {
      const cells = columns.map((column) => (column[i] === null ? "" : Number(column[i].toPrecision(7))));
      lines.push([panels.dated ? dateOf(x[i]) : Number(x[i].toPrecision(7)), ...cells].join(","));
    }
    return `${lines.join("\r\n")}\r\n`;
  }

  function download(name, text) {
    const link = element("a", { href: URL.createObjectURL(new Blob([text], { type: "text/csv" })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  function tools(figure, x, panels) {
    const act = (words, label, run) => {
      const made = button(words, run);
      made.setAttribute("aria-label", label);
      return made;
    };
    const { group } = figure;
    return element("div", { class: "tools" },
      act("+", "Zoom in", () => zoom(group, 2)), act("−", "Zoom out", () => zoom(group, 0.5)),
      act("←", figure.x.log ? "Lower" : "Earlier", () => zoom(group, 1, -0.5)),
      act("→", figure.x.log ? "Higher" : "Later", () => zoom(group, 1, 0.5)),
      button("Show all", () => reset(group)),
      button("Download the numbers (CSV)", () => download(`${figure.file}.csv`, csvOf(x, panels))),
      element("span", {}, "Drag across a chart to zoom, double-click to show all."));
  }

  function describe(panel) {
    const parts = panel.curves.map((curve, i) => {
      const [low, high] = rangeOf(panel.values[i]);
      return low > high ? `${curve.name}: no values` : `${curve.name} from ${digits(low)} to ${digits(high)}`;
    });
    return `${panel.label} [${panel.unit}]: ${parts.join("; ")}. Arrow keys move the cursor, plus and minus zoom, 0 shows all.`;
  }

  function drawn(live, figure, x, panels) {
    live.replaceChildren(tools(figure, x, panels));
    const place = element("p", { class: "place", "aria-live": "polite" });
    const charts = panels.map((panel, i) => {
      const box = element("div", { class: "panel", tabindex: "0", role: "group", "aria-label": describe(panel) });
      live.append(box);
      const chart = new uPlot(optionsOf(panel, figure, live.clientWidth, i === panels.length - 1), [x, ...panel.values]);
      chart.placeOf = i === 0 ? place : null;
      chart.placeWords = (at) => `${figure.x.label}: ${figure.x.dates ? dateOf(x[at]) : digits(x[at])}`;
      box.append(legendOf(chart, panel), chart.root);
      box.addEventListener("keydown", keys(chart, figure.group));
      return chart;
    });
    live.append(place);
    return charts;
  }

  async function start(holder) {
    const figure = JSON.parse(holder.querySelector("script.numbers").textContent);
    const x = await abscissa(figure.x);
    const panels = await Promise.all(figure.panels.map(async (panel) => ({
      ...panel, values: await Promise.all(panel.curves.map(unpacked)),
    })));
    panels.abscissa = figure.x.label;
    panels.dated = figure.x.dates;
    const live = element("div", { class: "live" });
    holder.querySelector(".still").before(live);
    holder.classList.add("is-live");
    let charts = [];
    const draw = () => {
      const others = (groups.get(figure.group) ?? []).filter((one) => !charts.includes(one));
      charts.forEach((one) => one.destroy());
      charts = drawn(live, figure, x, panels);
      groups.set(figure.group, [...others, ...charts]);
    };
    draw();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    let width = live.clientWidth;
    new ResizeObserver(() => {
      if (live.clientWidth === width || live.clientWidth === 0) return;
      width = live.clientWidth;
      charts.forEach((one) => one.setSize({ width, height: one.height }));
    }).observe(live);
  }

  async function all() {
    for (const holder of document.querySelectorAll("figure.charts")) {
      try {
        await start(holder);
      } catch (error) {
        holder.classList.remove("is-live");
        console.warn("the still picture stays", error);
      }
    }
    document.documentElement.classList.add("charts-drawn");
  }

  if (typeof uPlot !== "undefined" && typeof DecompressionStream !== "undefined") all();
})();
