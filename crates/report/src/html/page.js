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
