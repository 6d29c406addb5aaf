/* SPDX-License-Identifier: Apache-2.0 */
// report/page.js -- moves the sliders, copies the commands, sorts the views and the table. The page is whole without it.
document.querySelectorAll(".compare input").forEach(function (slider) {
  function move() { slider.parentNode.style.setProperty("--at", slider.value + "%"); }
  slider.addEventListener("input", move);
  move();
});

document.querySelectorAll("pre").forEach(function (box) {
  if (!navigator.clipboard) return; // a page from a file has it, one from another host over plain HTTP has not
  const command = box.textContent.replace(/^\$ /, ""), button = document.createElement("button");
  button.type = "button";
  button.textContent = "Copy";
  button.addEventListener("click", function () {
    navigator.clipboard.writeText(command).then(function () {
      button.textContent = "Copied";
      setTimeout(function () { button.textContent = "Copy"; }, 1200);
    }, function () { prompt("Copy this:", command); });
  });
  box.appendChild(button);
});

// What was not measured comes last, in both orders.
function numberOf(text, sign) { return text === undefined ? sign * Infinity : Number(text); }

function sortChildren(parent, value, sign) {
  Array.from(parent.children).sort(function (a, b) {
    const x = value(a), y = value(b), both = !isNaN(x - y);
    return sign * (both ? x - y : x < y ? -1 : x > y) || a.dataset.place - b.dataset.place;
  }).forEach(function (child) { parent.appendChild(child); });
}

const order = document.getElementById("order");
if (order) {
  order.parentNode.hidden = false;
  order.addEventListener("change", function () {
    const choice = order.value.split(" "), sign = choice[1] === "up" ? 1 : -1;
    sortChildren(document.querySelector(".views"), function (view) { return numberOf(view.dataset[choice[0]], sign); }, sign);
  });
}

document.querySelectorAll("table.sortable th[data-sort]").forEach(function (head) {
  head.tabIndex = 0;
  function sort() {
    const up = head.getAttribute("aria-sort") !== "ascending", sign = up ? 1 : -1, column = head.cellIndex;
    head.parentNode.querySelectorAll("th").forEach(function (other) { other.removeAttribute("aria-sort"); });
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    sortChildren(head.closest("table").tBodies[0], function (row) {
      const cell = row.cells[column];
      return head.dataset.sort === "text" ? cell.textContent : numberOf(cell.dataset.value, sign);
    }, sign);
  }
  head.addEventListener("click", sort);
  head.addEventListener("keydown", function (event) { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); sort(); } });
});
