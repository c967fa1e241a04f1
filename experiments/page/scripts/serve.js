// The page on which logs are dropped: it sends files to the server that it comes from, and shows what comes of them.
"use strict";

(() => {
  const OFTEN = 1000; // time between two looks while something is unfinished [ms]
  const SELDOM = 10000; // the same while nothing is [ms]
  const PATIENCE = 30000; // time after which a look that has no answer is given up, and the next one follows [ms]
  const MOST = 100; // logs that are asked for at once
  const holder = document.querySelector(".dropped-logs");
  const [input, verb] = [document.getElementById("file"), document.getElementById("verb")];
  const body = holder.querySelector("tbody");
  const [comparing, older] = [holder.querySelector("button.compare"), holder.querySelector("button.older")];
  const status = holder.querySelector(".place");
  const ticked = new Set();
  const coming = new Map(); // files on their way, by a key: name and what share has come
  let asked = MOST;
  let due = 0;
  let begun = 0; // looks so far
  let newest = 0; // the latest of them that was shown
  let shown = "";
  let refused = ""; // what was not done last; it stays in sight until something else is asked

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  // Delete a log, or have it worked on again; returns why not, where it was not.
  async function askedOf(id, method, more = "") {
    try {
      const answer = await fetch(`api/logs/${id}${more}`, { method });
      return answer.ok || answer.status === 404 ? "" : (await answer.json()).detail;
    } catch (error) {
      return `the server does not answer: ${error.message}`;
    }
  }

  function stateWords(log) {
    if (log.state === "running") return `running, ${log.phase}`;
    return log.state;
  }

  function row(log) {
    const named = element("th", { scope: "row", class: "name" });
    named.append(log.page ? element("a", { href: `logs/${log.id}` }, log.name) : log.name);
    const tick = element("input", { type: "checkbox", "aria-label": `Compare ${log.name}` });
    tick.checked = ticked.has(log.id);
    tick.disabled = log.state !== "done" || log.verb === "inspect"; // which has no quantities
    tick.addEventListener("change", () => {
      if (tick.checked) ticked.add(log.id);
      else ticked.delete(log.id);
      comparing.disabled = ticked.size !== 2;
    });
    const remove = element("button", { type: "button", "aria-label": `Delete ${log.name}` }, "Delete");
    remove.addEventListener("click", async () => {
      if (!window.confirm(`Delete ${log.name} and what came of it?`)) return;
      const why = await askedOf(log.id, "DELETE");
      refused = why ? `${log.name} was not deleted: ${why}` : "";
      ticked.delete(log.id);
      await look();
    });
    const state = element("td", { "data-head": "state", class: log.state === "failed" ? "bad" : "" }, `${stateWords(log)} (${log.verb})`);
    if (!["waiting", "running"].includes(log.state) && !log.page) {
      const again = element("button", { type: "button", "aria-label": `Work on ${log.name} again` }, "Again");
      again.addEventListener("click", async () => {
        const why = await askedOf(log.id, "POST", "/again");
        refused = why ? `${log.name} is not worked on again: ${why}` : "";
        await look();
      });
      state.append(" ", again);
    }
    return element(
      "tr",
      {},
      named,
      state,
      element("td", { "data-head": "verdict" }, (log.message ?? "").replaceAll(" %", "\u00a0%")),
      element("td", { "data-head": "compare" }, tick),
      element("td", { "data-head": "delete" }, remove),
    );
  }

  function comingRow({ name, share }) {
    const bar = element("progress", { max: "1", value: String(share), "aria-label": `${name} is sent` });
    return element(
      "tr",
      {},
      element("th", { scope: "row", class: "name" }, name),
      element("td", { "data-head": "state" }, "sending"),
      element("td", {}, bar),
      element("td"),
      element("td"),
    );
  }

  async function latest() {
    let logs = [];
    let counts = {};
    while (logs.length < asked) {
      const before = logs.length ? `&before=${logs.at(-1).number}` : "";
      const answer = await fetch(`api/logs?most=${MOST}${before}`, { signal: AbortSignal.timeout(PATIENCE) });
      if (!answer.ok) throw new Error((await answer.json()).detail);
      const page = await answer.json();
      ({ counts } = page);
      logs = logs.concat(page.logs);
      if (page.logs.length < MOST) break;
    }
    return { logs, counts };
  }

  async function look() {
    clearTimeout(due);
    const turn = (begun += 1);
    let unfinished = true;
    try {
      const { logs, counts } = await latest();
      if (turn < newest) return; // what was asked later has been answered already
      newest = turn;
      const there = new Set(logs.map((log) => log.id)); // another page may have deleted one that is ticked here
      for (const id of ticked) if (!there.has(id)) ticked.delete(id);
      const total = Object.values(counts).reduce((sum, one) => sum + one, 0);
      unfinished = (counts.unfinished ?? 0) > 0;
      const text = JSON.stringify([logs, [...coming.values()]]);
      if (text !== shown) {
        shown = text;
        const place = document.activeElement?.getAttribute("aria-label");
        body.replaceChildren(...[...coming.values()].map(comingRow), ...logs.map(row));
        if (place) body.querySelector(`[aria-label="${CSS.escape(place)}"]`)?.focus();
      }
      older.hidden = logs.length >= total;
      comparing.disabled = ticked.size !== 2;
      if (!coming.size) {
        const left = counts.unfinished ? `${counts.unfinished} still to do` : total === 1 ? "finished" : "all finished";
        const counted = total ? `${total} ${total === 1 ? "log" : "logs"}, ${left}.` : "No log yet.";
        status.textContent = refused ? `${refused.replace(/\.$/, "")}. ${counted}` : counted;
      }
    } catch (error) {
      status.textContent = `The server does not answer: ${error.message}`;
    }
    if (turn === begun) due = setTimeout(look, unfinished ? OFTEN : SELDOM);
  }

  function send(file, wanted) {
    return new Promise((done) => {
      const key = Symbol(file.name);
      coming.set(key, { name: file.name, share: 0 });
      const request = new XMLHttpRequest(); // fetch does not tell how much was sent
      request.open("POST", `api/logs?name=${encodeURIComponent(file.name)}&verb=${wanted}`);
      request.upload.addEventListener("progress", (event) => {
        coming.set(key, { name: file.name, share: event.total ? event.loaded / event.total : 0 });
      });
      request.addEventListener("loadend", () => {
        coming.delete(key);
        if (request.status === 429) {
          done("busy");
          return;
        }
        let said = "";
        if (request.status !== 202) {
          try {
            said = JSON.parse(request.responseText).detail;
          } catch {
            said = "the server closed the connection";
          }
        }
        done(said);
      });
      request.send(file);
    });
  }

  async function isFile(file) { // a folder that is dropped has no content
    try {
      await file.slice(0, 1).arrayBuffer();
      return true;
    } catch {
      return false;
    }
  }

  async function take(files) {
    const refusals = [];
    refused = "";
    for (const file of files) {
      if (!(await isFile(file))) {
        refusals.push(`${file.name}: is a folder, or cannot be read; drop the files themselves`);
        continue;
      }
      status.textContent = `Sending ${file.name}.`;
      look();
      let said = await send(file, verb.value);
      while (said === "busy") {
        status.textContent = `The server is busy; ${file.name} is sent again in five seconds.`;
        await new Promise((later) => setTimeout(later, 5000));
        said = await send(file, verb.value);
      }
      if (said) refusals.push(`${file.name}: ${said}`);
      await look();
    }
    if (refusals.length) refused = `Not taken: ${refusals.join("; ")}`;
    if (refused) await look();
  }

  const field = holder.querySelector(".drop-here");
  for (const kind of ["dragenter", "dragover"]) { // beside the field too, where a browser would open the file instead
    window.addEventListener(kind, (event) => {
      event.preventDefault();
      field.classList.add("over");
    });
  }
  window.addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) field.classList.remove("over");
  });
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    field.classList.remove("over");
    take([...event.dataTransfer.files]);
  });
  input.addEventListener("change", async () => {
    const files = [...input.files];
    input.value = "";
    await take(files);
  });
  comparing.addEventListener("click", () => {
    const [second, first] = [...body.querySelectorAll("a")].map((one) => one.getAttribute("href").slice(5)).filter((id) => ticked.has(id));
    window.location.assign(`compare?first=${first}&second=${second}`);
  });
  older.addEventListener("click", () => {
    asked += MOST;
    look();
  });
  document.querySelector(".api").textContent = new URL("api/logs", window.location.href).href;
  look();
})();
