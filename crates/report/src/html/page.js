"use strict";
for (const table of document.querySelectorAll("table.sortable")) {
  const body = table.tBodies[0];
  const headers = [...table.tHead.rows[0].cells];
  const original = [...body.rows];
  headers.forEach((header, column) => {
    const button = header.querySelector("button");
    if (!button) return;
    const numeric = header.classList.contains("number");
    const key = (row) => {
      const cell = row.cells[column];
      const value = cell.dataset.value;
      if (value !== undefined) return Number(value);
      const text = cell.textContent.trim();
      if (!numeric) return text;
      // 0.0879(5), 3.21(4)e-13
      const number = parseFloat(text.replace(/\(\d+\)/, ""));
      return Number.isFinite(number) ? number : null;
    };
    button.addEventListener("click", () => {
      const up = header.getAttribute("aria-sort") !== "ascending";
      const sign = up ? 1 : -1;
      const rows = original.map((row) => [key(row), row]);
      rows.sort(([a], [b]) => {
        if (a === null || b === null) return (a === null) - (b === null);
        if (typeof a === "number" && typeof b === "number") return sign * (a - b);
        return sign * String(a).localeCompare(String(b), "en", { numeric: true });
      });
      body.append(...rows.map(([, row]) => row));
      for (const other of headers) other.removeAttribute("aria-sort");
      header.setAttribute("aria-sort", up ? "ascending" : "descending");
    });
  });
}
const wide = [...document.querySelectorAll(".wide")];
const measure = () => {
  for (const box of wide) box.classList.toggle("scrolls", box.scrollWidth > box.clientWidth + 1);
};
addEventListener("resize", measure);
addEventListener("toggle", measure, true);
measure();
let opened = [];
addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details:not([open])")];
  for (const details of opened) details.open = true;
});
addEventListener("afterprint", () => {
  for (const details of opened) details.open = false;
});
for (const figure of document.querySelectorAll("figure")) {
  const all = (of, what) => [...of.querySelectorAll(what)];
  const pictures = all(figure, "svg[role=img]").filter((picture) => picture.querySelector("[data-name]"));
  const shown = (picture) => all(picture, ".p").filter((point) => !point.closest(".off"));
  // A picture is one stop of the tab key, and arrow keys go on from there.
  const stop = (picture) => shown(picture).forEach((point, i) => point.setAttribute("tabindex", i ? -1 : 0));
  const toggle = (number) => {
    for (const part of all(figure, `[data-name="${number}"], [data-of="${number}"]`)) {
      const off = part.classList.toggle("off");
      if (part.dataset.name) part.setAttribute("aria-pressed", !off);
    }
    pictures.forEach(stop);
  };
  for (const name of all(figure, "[data-name]")) {
    for (const [key, value] of [["role", "button"], ["tabindex", 0], ["aria-pressed", true]]) name.setAttribute(key, value);
  }
  for (const picture of pictures) picture.setAttribute("role", "group");
  pictures.forEach(stop);
  const words = document.createElement("p");
  const show = ({ target }) => {
    if (!target.matches(".p")) return;
    const [text, command] = target.textContent.split("\n");
    const code = document.createElement("code");
    code.textContent = command;
    words.replaceChildren(`${text}. `, code);
  };
  if (shown(figure).length) {
    words.className = "words";
    words.setAttribute("role", "status");
    words.textContent = "Point at a value for its numbers and the command that replays a trial, one that failed if any did. " +
      "A click on a name hides its line.";
    figure.lastElementChild.before(words);
  }
  figure.addEventListener("pointerover", show);
  figure.addEventListener("focusin", show);
  figure.addEventListener("click", ({ target }) => {
    const name = target.closest("[data-name]");
    if (name) toggle(name.dataset.name);
  });
  figure.addEventListener("keydown", (event) => {
    const { target, key } = event;
    const step = { ArrowRight: 1, ArrowLeft: -1 }[key];
    if (target.dataset.name && (key === "Enter" || key === " ")) toggle(target.dataset.name);
    else if (target.matches(".p") && step) {
      const points = shown(target.ownerSVGElement);
      points[points.indexOf(target) + step]?.focus();
    } else return;
    event.preventDefault();
  });
}
