// Limits that a reader sets: each input of class "limit" says which of the row's words stands, and moves its mark.
"use strict";

(() => {
  const key = (input) => `hydrostate limit ${input.name}`;

  const stored = (input) => {
    try {
      return localStorage.getItem(key(input));
    } catch {
      return null; // a browser may keep nothing for a file
    }
  };

  function keep(input) {
    try {
      if (input.value === input.defaultValue) localStorage.removeItem(key(input));
      else localStorage.setItem(key(input), input.value);
    } catch {
      // as above
    }
  }

  // A quantity that must stay below its limit passes it upwards, bulk modulus downwards.
  function state(input) {
    const sign = input.dataset.side === "below" ? -1 : 1;
    const [value, near, far] = ["value", "low", "high"].map((name) => sign * Number(input.dataset[name]));
    const limit = sign * Number(input.value);
    if (input.dataset.doubted !== undefined) return "doubted"; // no fit explains the log: neither good nor bad
    if (input.value === "" || !Number.isFinite(limit) || !Number.isFinite(value)) return "none";
    const [low, high] = [Math.min(near, far), Math.max(near, far)];
    if (low > limit) return "over";
    if (value > limit) return "likely";
    return high > limit ? "open" : "within";
  }

  const WORDS = {
    doubted: "not reliable", none: "no limit", over: "past the limit", likely: "probably past the limit",
    open: "may be past the limit", within: "within the limit",
  };

  function update(input) {
    const row = input.closest("tr");
    const found = state(input);
    const said = row.querySelector(".state");
    said.textContent = WORDS[found];
    said.dataset.state = found;
    const mark = row.querySelector(".limit-mark");
    const [first, last] = [Number(input.dataset.first), Number(input.dataset.last)];
    const share = (Number(input.value) - first) / (last - first);
    mark.setAttribute("visibility", input.value !== "" && share >= 0 && share <= 1 ? "visible" : "hidden");
    mark.setAttribute("x1", 100 * share);
    mark.setAttribute("x2", 100 * share);
  }

  for (const input of document.querySelectorAll("input.limit")) {
    input.disabled = false;
    const kept = stored(input);
    if (kept !== null) input.value = kept;
    input.addEventListener("input", () => {
      update(input);
      keep(input);
    });
    update(input);
  }

  for (const reset of document.querySelectorAll("button.reset-limits")) {
    reset.hidden = false;
    reset.addEventListener("click", () => {
      for (const input of document.querySelectorAll("input.limit")) {
        input.value = input.defaultValue;
        keep(input);
        update(input);
      }
    });
  }
})();
