// A table of many rows: only those in sight are in the page. Headings sort, words and a state filter.
"use strict";

(() => {
  const narrow = matchMedia("(max-width: 62rem)"); // there a row is a card of three lines
  const rowHeight = () => (narrow.matches ? 114 : 36); // [px], as in the style
  const SPARE = 12; // rows above and below those in sight

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  const numberText = new Intl.NumberFormat("en", { maximumSignificantDigits: 3, useGrouping: false });

  function cell(column, value, link) {
    if (column.kind === "number") {
      const words = value === null ? "–" : `${numberText.format(value).replace("-", "\u2212")}${column.unit ? ` ${column.unit}` : ""}`;
      return element("td", { class: value === null ? "number unknown" : "number", role: "cell", "data-head": column.label }, words);
    }
    if (column.kind === "state") return element("td", { class: `fleet-${value}`, role: "cell" }, column.words[value]);
    if (column.kind === "name") {
      const name = link ? element("a", { href: link }, value) : value;
      return element("th", { scope: "row", role: "rowheader", title: value }, element("span", { class: "two-lines" }, name));
    }
    const lines = value ? [element("span", { class: "two-lines" }, value)] : [];
    return element("td", { title: value, role: "cell", "data-head": column.label }, ...lines);
  }

  function start(holder) {
    const { columns, rows, links } = JSON.parse(holder.querySelector("script.rows").textContent);
    const states = columns.findIndex((column) => column.kind === "state");
    const ranks = Object.keys(columns[states].words);
    let order = rows.map((_, i) => i);
    let sorted = { column: -1, down: false };

    const words = element("input", { type: "search", id: "fleet-words", placeholder: "name, condition, ..." });
    const state = element("select", { id: "fleet-state" }, element("option", { value: "" }, "all"));
    for (const name of ranks) state.append(element("option", { value: name }, columns[states].words[name]));
    const count = element("p", { class: "place", role: "status" });
    const head = element("tr", { role: "row" });
    const body = element("tbody", { role: "rowgroup" });
    const table = element("table", { class: "fleet", role: "table" }, element("caption", {}, holder.dataset.caption), element("thead", { role: "rowgroup" }, head), body);
    const more = element("p", { class: "place more-rows" });
    const view = element("div", { class: "window", tabindex: "0", role: "region", "aria-label": holder.dataset.caption }, table);

    const plain = (text) => text.normalize("NFC").toLowerCase(); // a file's name may hold an accent as a letter of its own

    function shownText(value, place) {
      if (columns[place].kind === "state") return columns[place].words[value];
      return typeof value === "string" ? value : "";
    }

    function key(row, column) {
      const value = rows[row][column];
      return columns[column].kind === "state" ? ranks.indexOf(value) : value;
    }

    function compare(one, other) {
      const [a, b] = [key(one, sorted.column), key(other, sorted.column)];
      if (a === b) return one - other;
      if (a === null || a === "") return 1; // what is not known stands last, either way
      if (b === null || b === "") return -1;
      const less = typeof a === "string" ? a.localeCompare(b, "en", { numeric: true }) : a - b;
      return sorted.down ? -less : less;
    }

    function arrange() {
      const asked = plain(words.value).trim().split(/\s+/).filter(Boolean);
      const fits = (row) => (!state.value || rows[row][states] === state.value)
        && asked.every((word) => rows[row].some((value, place) => plain(shownText(value, place)).includes(word)));
      order = rows.map((_, i) => i).filter(fits);
      if (sorted.column >= 0) order.sort(compare);
      count.textContent = `${order.length} of ${rows.length} rows`;
      table.setAttribute("aria-rowcount", String(order.length + 1));
      view.scrollTop = 0;
      draw();
    }

    function spacer(rowsAway) {
      const gap = element("tr", { "aria-hidden": "true" }, element("td", { colspan: String(columns.length), class: "gap" }));
      gap.style.height = `${rowsAway * rowHeight()}px`;
      return gap;
    }

    function cells(values, link) { // a reason takes the place of the empty cell after it too
      const empty = (place) => columns[place]?.kind === "text" && values[place] === "";
      const wide = (place) => columns[place]?.kind === "text" && values[place] && empty(place + 1);
      return columns.flatMap((column, place) => {
        if (empty(place) && wide(place - 1)) return [];
        const made = cell(column, values[place], link);
        if (wide(place)) made.setAttribute("colspan", "2");
        return [made];
      });
    }

    function draw() {
      const first = Math.max(0, Math.floor(view.scrollTop / rowHeight()) - SPARE);
      const last = Math.min(order.length, first + Math.ceil(view.clientHeight / rowHeight()) + 2 * SPARE);
      const shown = order.slice(first, last).map((row, i) => {
        return element("tr", { role: "row", "aria-rowindex": String(first + i + 2) }, ...cells(rows[row], links[row]));
      });
      const seen = Math.min(order.length, Math.floor((view.scrollTop + view.clientHeight - table.tHead.offsetTop - table.tHead.offsetHeight) / rowHeight()));
      const below = order.length - Math.max(seen, 0);
      view.classList.toggle("more", below > 0);
      more.textContent = below > 0 ? `${below} more ${below === 1 ? "row" : "rows"} below: scroll in the table.` : "";
      body.replaceChildren(...(first > 0 ? [spacer(first)] : []), ...shown, ...(last < order.length ? [spacer(order.length - last)] : []));
    }

    table.style.setProperty("--least", `${columns.reduce((sum, column) => sum + column.width, 0)}rem`);
    columns.forEach((column, place) => {
      const heading = element("th", { scope: "col", role: "columnheader", "aria-sort": "none", class: column.kind === "number" ? "number" : "" });
      const sort = element("button", { type: "button" }, column.label);
      sort.addEventListener("click", () => {
        sorted = { column: place, down: sorted.column === place ? !sorted.down : column.kind === "number" };
        for (const other of head.children) other.setAttribute("aria-sort", "none");
        heading.setAttribute("aria-sort", sorted.down ? "descending" : "ascending");
        arrange();
      });
      heading.style.width = `${column.width}rem`;
      heading.append(sort);
      head.append(heading);
    });
    words.addEventListener("input", arrange);
    state.addEventListener("change", arrange);
    view.addEventListener("scroll", () => requestAnimationFrame(draw), { passive: true });
    const filters = element("div", { class: "tools" },
      element("label", { for: "fleet-words" }, "Show rows with"), words,
      element("label", { for: "fleet-state" }, "in state"), state);
    holder.querySelector(".still").before(element("div", { class: "live" }, filters, count, view, more));
    holder.classList.add("is-live");
    narrow.addEventListener("change", draw);
    new ResizeObserver(draw).observe(view);
    arrange();
    document.documentElement.classList.add("table-drawn");
  }

  document.querySelectorAll(".fleet-table").forEach(start);
})();
