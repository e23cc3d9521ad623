"use strict";
// Sorts a table by a column: numbers by value, the rest as text, empty cells last. A column whose
// head says data-unit has values in the unit of each row: metres are not compared with seconds, so
// rows of one unit stay together, and the units keep the order in which they stand in the table.
function keyOf(row, column) {
  const cell = row.cells[column];
  const text = "value" in cell.dataset ? cell.dataset.value : cell.firstChild ? cell.textContent.trim() : "";
  const value = Number.parseFloat(text);
  return { text, value, empty: text === "" || text === "–" };
}
function sortTable(table, column, descending) {
  const body = table.tBodies[0];
  const rows = Array.from(body.rows, (row) => ({ row, key: keyOf(row, column) }));
  const hasUnits = "unit" in table.tHead.rows[0].cells[column].dataset;
  const units = [...new Set(rows.map(({ row }) => row.dataset.unit))];
  const unitOf = ({ row }) => units.indexOf(row.dataset.unit);
  const numeric = rows.every(({ key }) => key.empty || Number.isFinite(key.value));
  rows.sort((a, b) => {
    if (hasUnits && unitOf(a) !== unitOf(b)) return unitOf(a) - unitOf(b);
    if (a.key.empty || b.key.empty) return a.key.empty - b.key.empty;
    const order = numeric ? a.key.value - b.key.value : a.key.text.localeCompare(b.key.text);
    return descending ? -order : order;
  });
  body.append(...rows.map(({ row }) => row));
}
for (const table of document.querySelectorAll("table.sortable")) {
  Array.from(table.tHead.rows[0].cells).forEach((head, column) => {
    head.querySelector("button").addEventListener("click", () => {
      const descending = head.getAttribute("aria-sort") === "ascending";
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", descending ? "descending" : "ascending");
      sortTable(table, column, descending);
    });
  });
}
for (const filters of document.querySelectorAll(".filters")) {
  const table = document.getElementById(filters.dataset.table);
  const rows = Array.from(table.tBodies[0].rows);
  const apply = () => {
    const wanted = Array.from(filters.querySelectorAll("select"))
      .filter((select) => select.value !== "")
      .map((select) => [Number(select.dataset.column), select.value]);
    const words = filters.querySelector("input").value.toLowerCase();
    let shown = 0;
    for (const row of rows) {
      const fits = wanted.every(([column, value]) => row.cells[column].textContent.trim() === value)
        && row.textContent.toLowerCase().includes(words);
      row.hidden = !fits;
      shown += fits;
    }
    filters.querySelector("output").textContent = `${shown} of ${rows.length} rows`;
  };
  filters.addEventListener("input", apply);
  apply();
}
// The replays are files beside this page, which may have been sent alone.
function replaysAreNotHere() {
  for (const link of document.querySelectorAll("a.replay, a.to-replay")) {
    const told = document.createElement("span");
    told.className = "missing";
    told.textContent = `${link.textContent}: not in this folder`;
    link.replaceWith(told);
  }
}
// A figure's file may be missing, too; its picture is in the page.
for (const link of document.querySelectorAll("a.svg")) {
  link.addEventListener("click", () => { link.href = link.closest("figure").querySelector("img").src; });
}
