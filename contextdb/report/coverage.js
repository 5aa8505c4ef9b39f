"use strict";
// Tables sort by the data-v of their cells; a square of a map shows the values of its pair. Texts are set as text, never as markup.
function element(name, text, className) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

function valueOf(row, at) {
  const cell = row.cells[at];
  return cell.dataset.v === undefined ? cell.textContent : Number(cell.dataset.v);
}

function sortBy(table, at) {
  const head = table.tHead.rows[0].cells[at];
  const first = head.classList.contains("n") ? "descending" : "ascending";
  const other = first === "ascending" ? "descending" : "ascending";
  const order = head.getAttribute("aria-sort") === first ? other : first;
  const sign = order === "ascending" ? 1 : -1;
  for (const cell of table.tHead.rows[0].cells) cell.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", order);
  const body = table.tBodies[0];
  const rows = Array.from(body.rows, (row, i) => [valueOf(row, at), i, row]);
  rows.sort((a, b) => (a[0] < b[0] ? -sign : a[0] > b[0] ? sign : a[1] - b[1]));
  body.append(...rows.map((item) => item[2]));
}

for (const table of document.querySelectorAll("table.sortable")) {
  Array.from(table.tHead.rows[0].cells).forEach((cell, at) => {
    if (cell.textContent === "") return;
    const button = element("button", cell.textContent);
    button.type = "button";
    button.addEventListener("click", () => sortBy(table, at));
    cell.replaceChildren(button);
  });
}

function showPair(panel, map, pair) {
  const [one, other] = [map.conditions[pair.of[0]], map.conditions[pair.of[1]]];
  const isOne = pair.of[0] === pair.of[1];
  panel.replaceChildren(element("h4", isOne ? one.name : one.name + " with " + other.name));
  const table = element("table", undefined, "heat");
  const head = table.createTHead().insertRow();
  head.append(element("th", ""));
  const columns = isOne ? [""] : other.parts;
  for (const part of columns) head.append(element("th", part));
  const body = table.createTBody();
  one.parts.forEach((part, i) => {
    const row = body.insertRow();
    row.append(element("th", part, "name"));
    columns.forEach((_, j) => {
      const slice = pair.slices[i * columns.length + j];
      const square = element("span", slice[1], "square " + slice[0]);
      square.title = slice[2];
      const cell = row.insertCell();
      cell.append(square);
    });
  });
  panel.append(table);
  const list = element("ul");
  for (const slice of pair.slices.filter((s) => s[3])) list.append(element("li", slice[2]));
  if (list.children.length) panel.append(element("p", "Covered least:"), list);
  panel.hidden = false;
}

function moveFocus(event, table) {
  const step = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
  const cell = event.target.closest("td");
  if (!step || !cell) return;
  const row = table.rows[cell.parentElement.rowIndex + step[0]];
  const next = row && row.cells[cell.cellIndex + step[1]];
  const button = next && next.querySelector("button");
  if (button) {
    button.focus();
    event.preventDefault();
  }
}

for (const section of document.querySelectorAll("section[data-map]")) {
  const map = JSON.parse(document.getElementById(section.dataset.map).textContent);
  const panel = section.querySelector(".detail");
  const table = section.querySelector("table.heat");
  table.addEventListener("keydown", (event) => moveFocus(event, table));
  for (const button of table.querySelectorAll("button")) {
    button.addEventListener("click", () => {
      for (const other of table.querySelectorAll("button")) other.setAttribute("aria-pressed", String(other === button));
      showPair(panel, map, map.pairs[Number(button.dataset.pair)]);
    });
  }
}
