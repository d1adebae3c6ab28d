// A click on the button of a figure puts its interactive replay in place of the picture, and back.
for (const button of document.querySelectorAll("figure.moving button")) {
  const picture = button.closest("figure").querySelector("p");
  const words = button.textContent;
  button.hidden = false;
  button.addEventListener("click", () => {
    const shown = picture.nextElementSibling.matches("iframe") ? picture.nextElementSibling : null;
    if (shown) {
      shown.remove();
    } else {
      const frame = document.createElement("iframe");
      frame.src = `${button.dataset.replay}#play`;
      frame.title = "Interactive replay";
      picture.after(frame);
    }
    picture.hidden = !shown;
    picture.nextElementSibling.scrollIntoView({ block: "nearest" });
    button.ariaExpanded = String(!shown);
    button.textContent = shown ? words : "Back to the picture";
  });
}

// A formula wider than its text stands by itself, and scrolls; no line begins with a comma.
addEventListener("load", async () => {
  await window.MathJax?.startup?.promise;
  for (const formula of document.querySelectorAll("mjx-container")) {
    const text = formula.closest("p, li, dd, td");
    const after = formula.parentElement.nextSibling;
    const [comma] = after?.nodeValue?.match(/^[,.;:)]+/) ?? [];
    const wide = text && formula.offsetWidth > text.clientWidth;
    if (comma) {
      after.deleteData(0, comma.length);
      (wide ? formula : formula.parentElement).append(comma);
    }
    if (wide) formula.classList.add("wide");
    else if (comma) formula.parentElement.style.whiteSpace = "nowrap";
  }
});

// A card shows its film under the mouse; without a mouse, in the middle of the window.
function play(card, on) {
  const picture = card.querySelector("img");
  picture.dataset.still ??= picture.src;
  picture.src = on ? picture.dataset.film : picture.dataset.still;
}
const middle = new IntersectionObserver(
  (seen) => seen.forEach(({ target, isIntersecting }) => play(target, isIntersecting)),
  { rootMargin: "-45% 0px" },
);
for (const card of document.querySelectorAll(".card")) {
  if (matchMedia("(hover: none)").matches) middle.observe(card);
  card.addEventListener("mouseenter", () => play(card, true));
  card.addEventListener("mouseleave", () => play(card, false));
}

// The filters of the environments: a card is seen where it is of all that is chosen.
const filters = document.querySelector("form.filters");
if (filters) {
  const cards = [...document.querySelectorAll(".card")];
  const selects = [...filters.querySelectorAll("select")];
  const choose = () => {
    for (const card of cards) {
      card.hidden = selects.some(({ name, value }) => value && card.dataset[name] !== value);
    }
    for (const section of new Set(cards.map((card) => card.closest("section")))) {
      section.hidden = !section.querySelector(".card:not([hidden])");
    }
    const n = cards.filter((card) => !card.hidden).length;
    filters.querySelector("output").textContent = `${n} of ${cards.length}`;
  };
  for (const select of selects) {
    const values = new Set(cards.map((card) => card.dataset[select.name]));
    for (const value of values) select.add(new Option(value));
  }
  filters.addEventListener("change", choose);
  filters.addEventListener("reset", () => setTimeout(choose));
  filters.hidden = false;
  choose();
}
