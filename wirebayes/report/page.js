// Tables can be sorted by any column: the headings become buttons, so that the keyboard works as well. A link to a
// section that is folded opens it.
"use strict";
(() => {
  const unfold = () => {
    const section = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const folded = section && section.querySelector(":scope > details");
    if (folded) folded.open = true;
  };
  addEventListener("hashchange", unfold);
  unfold();
  const raised = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻";
  const number = text => {  // the first number of a cell as the page writes them: thin spaces, minus signs, powers of ten
    const match = text.replace(/[\u202f\u2009]/g, "").replace(/−/g, "-").match(/-?\d*\.?\d+(?:·10([⁰-⁹¹²³⁻]+))?/);
    if (!match) return NaN;
    const power = match[1] ? Number([...match[1]].map(c => "0123456789-"[raised.indexOf(c)]).join("")) : 0;
    return parseFloat(match[0]) * 10 ** power;
  };
  const sort = (table, column, direction) => {
    const rows = [...table.tBodies[0].rows], text = row => row.cells[column].textContent.trim();
    const numeric = rows.filter(row => /^[^A-Za-z]*\d/.test(text(row))).length > rows.length / 2;
    const compare = (a, b) => {
      if (!numeric) return direction * text(a).localeCompare(text(b), "en", {numeric: true});
      const x = number(text(a)), y = number(text(b));
      return isNaN(x) || isNaN(y) ? isNaN(x) - isNaN(y) : direction * (x - y);  // what has no number comes last
    };
    rows.sort(compare).forEach(row => table.tBodies[0].append(row));
    [...table.tHead.rows[0].cells].forEach((cell, i) => {
      if (i === column) cell.setAttribute("aria-sort", direction > 0 ? "ascending" : "descending");
      else cell.removeAttribute("aria-sort");
    });
  };
  for (const table of document.querySelectorAll("table")) {
    if (table.tBodies[0].rows.length < 3) continue;
    [...table.tHead.rows[0].cells].forEach((cell, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.title = "Sort by this column";
      button.append(...cell.childNodes);
      cell.append(button);
      button.addEventListener("click", () =>
        sort(table, column, cell.getAttribute("aria-sort") === "ascending" ? -1 : 1));
    });
  }
})();
