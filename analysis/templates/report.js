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
  filters.addEventListener("input", () => { apply(); keepState(); });
  filters.applyAll = apply;
  apply();
}
// The state of the page stands in its address, so that a link shows what its sender saw: hidden
// controllers, the choices above each table, and what is seen of each chart that was zoomed.
const hiddenControllers = new Set();
const hiddenListeners = [];
const ZOOM = "zoom.";
const zooms = new Map();
function keepState() {
  const state = new URLSearchParams();
  if (hiddenControllers.size) state.set("hide", [...hiddenControllers].join("\n"));
  for (const filters of document.querySelectorAll(".filters")) {
    for (const select of filters.querySelectorAll("select")) {
      if (select.value) state.set(`${filters.dataset.table}.${select.dataset.column}`, select.value);
    }
    const words = filters.querySelector("input").value;
    if (words) state.set(`${filters.dataset.table}.search`, words);
  }
  for (const [chart, ends] of zooms) state.set(ZOOM + chart, ends.map((end) => Number(end.toPrecision(6))).join(" "));
  const query = state.toString();
  try { history.replaceState(null, "", `${query ? `?${query}` : location.pathname}${location.hash}`); } catch { /* Not everywhere a file's address may change. */ }
}
function showHidden() {
  for (const button of document.querySelectorAll("#columns button")) {
    button.setAttribute("aria-pressed", String(!hiddenControllers.has(button.dataset.controller)));
  }
  const isHidden = (element) => hiddenControllers.has(element.dataset.controller);
  for (const bar of document.querySelectorAll(".bar")) bar.classList.toggle("of-hidden", isHidden(bar));
  for (const table of document.querySelectorAll("table")) {
    const heads = Array.from(table.tHead ? table.tHead.rows[0].cells : []);
    const chipOf = (cell) => cell.querySelector(".chip");
    heads.forEach((head, column) => {
      const chip = chipOf(head);
      if (!chip) return;
      for (const row of table.rows) row.cells[column]?.classList.toggle("of-hidden", isHidden(chip));
    });
    if (heads.some(chipOf)) continue;
    for (const row of table.tBodies[0]?.rows || []) {
      row.classList.toggle("of-hidden", Array.from(row.querySelectorAll("td .chip")).some(isHidden));
    }
  }
  for (const told of hiddenListeners) told();
}
for (const button of document.querySelectorAll("#columns button")) {
  button.addEventListener("click", () => {
    const name = button.dataset.controller;
    if (!hiddenControllers.delete(name)) hiddenControllers.add(name);
    showHidden();
    keepState();
  });
}
function restoreState() {
  const state = new URLSearchParams(location.search);
  const known = Array.from(document.querySelectorAll("#columns button"), (button) => button.dataset.controller);
  for (const name of (state.get("hide") || "").split("\n")) if (known.includes(name)) hiddenControllers.add(name);
  for (const [key, text] of state) {
    const ends = text.split(" ").map(Number);
    if (key.startsWith(ZOOM) && ends.length === 4 && ends.every(Number.isFinite)) zooms.set(key.slice(ZOOM.length), ends);
  }
  for (const filters of document.querySelectorAll(".filters")) {
    for (const select of filters.querySelectorAll("select")) select.value = state.get(`${filters.dataset.table}.${select.dataset.column}`) || "";
    filters.querySelector("input").value = state.get(`${filters.dataset.table}.search`) || "";
    filters.applyAll();
  }
  showHidden();
}
restoreState();
// Every table as CSV: the rows that are shown, with the values that they are sorted by.
function csvOf(table) {
  const rows = Array.from(table.rows).filter((row) => !row.hidden && !row.classList.contains("of-hidden"));
  return rows.map((row) => Array.from(row.cells).filter((cell) => !cell.classList.contains("of-hidden")).map((cell) => {
    const name = cell.querySelector("code.name");
    const text = cell.dataset.value || (name ? name.textContent : cell.textContent.replace(/\s+/g, " ").trim());
    return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  }).join(",")).join("\n") + "\n";
}
for (const table of document.querySelectorAll("table")) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "csv";
  button.textContent = "CSV";
  button.addEventListener("click", () => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([csvOf(table)], { type: "text/csv" }));
    link.download = `${table.id || table.closest("section")?.id || "table"}.csv`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
  (table.closest(".scroll") || table).before(button);
}
// Opens the replay of a trial, or shows the row with the command that makes one.
function showTrial(scenario, controller, trial) {
  const rows = Array.from(document.querySelectorAll("#trials-table tbody tr"));
  const row = rows.find(({ cells }) => cells[0].textContent === scenario && cells[1].textContent.trim() === controller && cells[2].dataset.value === String(trial));
  if (!row) return;
  const link = row.querySelector("a.to-replay");
  if (link) { location.href = link.href; return; }
  for (const other of rows) other.classList.remove("pointed-at");
  row.hidden = false;
  row.classList.add("pointed-at");
  row.scrollIntoView({ block: "center" });
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
