// The answers of the first picture in view when a reader points at its values, goes from one to the next by keys, and hides methods.
globalThis.pointed = () => {
  const figure = document.querySelector("figure");
  const picture = [...figure.querySelectorAll("svg.asoplot")].find((of) => of.getClientRects().length);
  const words = figure.querySelector(".words");
  const first = words.textContent;
  const under = (of) => {
    of.scrollIntoView({ block: "center", behavior: "instant" });
    const place = of.getBoundingClientRect();
    return document.elementFromPoint(place.x + place.width / 2, place.y + place.height / 2);
  };
  const points = [...picture.querySelectorAll(".p")];
  const hovered = points.filter((point) => under(point) === point).map((point) => {
    point.dispatchEvent(new PointerEvent("pointerover", { bubbles: true }));
    return words.textContent;
  });
  const key = (name) => document.activeElement.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true }));
  const walked = [];
  const stops = picture.querySelectorAll(".p[tabindex='0']");
  stops[0].focus();
  for (const _ of points) {
    walked.push(words.textContent);
    key("ArrowRight");
  }
  const hidden = (name) => {
    const of = [...picture.querySelectorAll(`[data-of="${name.dataset.name}"]`)];
    const others = [...picture.querySelectorAll("[data-of]")].filter((part) => !of.includes(part));
    const none = (part) => getComputedStyle(part).display === "none";
    return [of.every(none), others.some(none), of.some(none), name.getAttribute("aria-pressed")];
  };
  const names = [...picture.querySelectorAll("[data-name]")].map((name) => {
    const click = () => under(name.querySelector("text")).dispatchEvent(new MouseEvent("click", { bubbles: true }));
    click();
    const once = hidden(name);
    name.focus();
    key("Enter");
    return { name: name.textContent, once, twice: hidden(name) };
  });
  const titles = points.map((point) => point.querySelector("title").textContent);
  return { first, count: points.length, titles, hovered, stops: stops.length, walked, names };
};
