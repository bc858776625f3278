// The words of a page on itself in a frame: its widths, its details, its tables, its links and its colours.
addEventListener("load", () => {
  const page = document.documentElement;
  const over = () => page.scrollWidth - page.clientWidth;
  const colours = [getComputedStyle(document.body).backgroundColor, getComputedStyle(document.querySelector("svg.asoplot text")).fill];
  const closed = over();
  const details = [...document.querySelectorAll("details")];
  for (const of of details) of.querySelector("summary").click();
  const scrolls = (of) => of.scrollWidth > of.clientWidth + 1 && ["auto", "scroll"].includes(getComputedStyle(of).overflowX);
  const unmarked = [...document.querySelectorAll("body *")].filter((of) => scrolls(of) && !of.matches(".wide, pre, nav"));
  const tables = [...document.querySelectorAll("table.sortable")].flatMap((table) =>
    [...table.tHead.rows[0].cells].flatMap((head, column) => {
      if (!head.matches(".number")) return [];
      const cells = () => [...table.tBodies[0].rows].map(({ cells }) => cells[column].dataset.value ?? cells[column].textContent);
      const [up, down] = ["ascending", "descending"].map((order) => {
        head.querySelector("button").click();
        return { order: head.getAttribute("aria-sort") === order, cells: cells() };
      });
      return [{ head: head.textContent, up, down }];
    }));
  const here = (link) => link.pathname === location.pathname && link.hash;
  const links = [...document.links];
  parent.postMessage({
    width: innerWidth, closed, open: over(), colours, tables,
    unmarked: unmarked.map((of) => of.outerHTML.slice(0, 80)),
    shut: details.filter((of) => !of.open || of.lastElementChild.getClientRects().length === 0).length,
    details: details.length,
    dangling: links.filter((link) => here(link) && !document.getElementById(decodeURIComponent(link.hash.slice(1)))).map((link) => link.hash),
    files: links.filter((link) => !here(link)).map((link) => decodeURIComponent(link.pathname)),
    pointed: globalThis.pointed?.(),
  }, "*");
});
