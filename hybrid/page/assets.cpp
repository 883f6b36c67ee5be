// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/page/assets.h"

namespace hybrid {

// Figures keep a white background in both schemes, because their colours are chosen for white (Okabe & Ito
// 2008). Wide figures and tables scroll in a box of their own, so that their text keeps its size on a small
// screen.
std::string_view page_style() {
  return R"css(
:root { color-scheme: light dark; --ground: #ffffff; --text: #1c2129; --quiet: #535c69; --line: #d5dae1;
  --band: #f3f5f8; --good: #05603a; --bad: #a3260f; --link: #0b5cad; }
@media (prefers-color-scheme: dark) {
  :root { --ground: #14181d; --text: #e4e8ee; --quiet: #a5afbd; --line: #38414d;
    --band: #1d232b; --good: #6fd6a5; --bad: #ff9a85; --link: #8fc1ff; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--text);
  font: 1rem/1.5 system-ui, "Segoe UI", Helvetica, Arial, "DejaVu Sans", sans-serif; }
main, footer { max-width: 94rem; margin: 0 auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; line-height: 1.3; margin: 1.5rem 0 0.3rem; max-width: 54rem; }
h1.good { border-left: 0.3rem solid var(--good); padding-left: 0.8rem; }
h1.bad { border-left: 0.3rem solid var(--bad); padding-left: 0.8rem; }
h2 { font-size: 1.2rem; margin: 2.2rem 0 0.4rem; padding-top: 0.5rem; border-top: 1px solid var(--line); }
p { max-width: 54rem; margin: 0.5rem 0; }
p.title { color: var(--quiet); margin: 0 0 1rem; }
figure { margin: 1rem 0; }
figcaption, caption { color: var(--quiet); font-size: 0.92rem; text-align: left; max-width: 54rem; }
figcaption { margin-top: 0.4rem; }
caption { padding-bottom: 0.4rem; max-width: min(54rem, calc(100vw - 2.5rem)); }
.wide { overflow-x: auto; margin: 1rem 0; }
.wide:focus-visible { outline: 2px solid var(--link); }
.card { max-width: 62rem; background: #ffffff; border: 1px solid var(--line); border-radius: 6px; }
.card svg { display: block; width: 100%; min-width: 42rem; height: auto; }
.card img { display: block; width: 100%; height: auto; border-radius: 6px; }
table { border-collapse: collapse; font-size: 0.92rem; font-variant-numeric: tabular-nums; }
th, td { padding: 0.3rem 0.7rem; text-align: left; vertical-align: top; border-bottom: 1px solid var(--line); }
thead th { background: var(--band); vertical-align: bottom; }
tbody th { font-weight: 600; }
td.n, th.n { text-align: right; white-space: nowrap; }
th.n { white-space: normal; }
td { white-space: nowrap; }
td.medium, td.long { white-space: normal; }
.medium { min-width: 11rem; }
.long { min-width: 17rem; }
td.good { color: var(--good); font-weight: 600; }
td.bad { color: var(--bad); font-weight: 600; }
button { font: inherit; color: inherit; background: none; border: 0; padding: 0; cursor: pointer; }
th button { font-weight: 600; text-align: inherit; }
th button::after { content: "\a0\2195"; color: var(--quiet); }
th[aria-sort="ascending"] button::after { content: "\a0\2191"; }
th[aria-sort="descending"] button::after { content: "\a0\2193"; }
button.copy { color: var(--link); font-size: 0.85rem; text-decoration: underline; margin-bottom: 0.4rem; }
footer { padding-bottom: 2rem; font-size: 0.92rem; }
dl { display: grid; grid-template-columns: max-content minmax(0, 1fr); gap: 0.2rem 1rem; }
dt { color: var(--quiet); } dd { margin: 0; overflow-wrap: anywhere; }
code { font: 0.9em/1.5 ui-monospace, "DejaVu Sans Mono", Consolas, monospace; }
@media (max-width: 40rem) { h1 { font-size: 1.25rem; } dl { grid-template-columns: 1fr; }
  th, td { padding: 0.25rem 0.45rem; } }
@media print {
  :root { color-scheme: light; --ground: #ffffff; --text: #000000; --quiet: #444444; --line: #bbbbbb;
    --band: #f3f3f3; --good: #05603a; --bad: #a3260f; }
  body { font-size: 9.5pt; } main, footer { max-width: none; padding: 0; }
  h2 { break-after: avoid; } figure, tr { break-inside: avoid; } thead { display: table-header-group; }
  .wide { overflow: visible; } .card svg { min-width: 0; } .card img { max-width: 11cm; }
  table { font-size: 8pt; } th, td { padding: 0.15rem 0.35rem; } .medium, .long { min-width: 0; }
  .copy { display: none; } th button::after { content: none !important; } }
)css";
}

std::string_view page_script() {
  return R"js(
(function () {
  'use strict';
  // The sorted value of a cell: a number where it has one, else its text.
  function key(row, column) {
    var cell = row.cells[column];
    var value = cell.getAttribute('data-value');
    return value === null ? cell.textContent.trim() : Number(value);
  }
  // Numbers come before texts in rising order; texts follow the reader's language.
  function order(a, b) {
    if (typeof a === 'number' && typeof b === 'number') return a - b;
    if (typeof a !== typeof b) return typeof a === 'number' ? -1 : 1;
    return a.localeCompare(b);
  }
  function sortBy(table, column) {
    var heads = table.tHead.rows[0].cells;
    var falling = heads[column].getAttribute('aria-sort') === 'ascending';
    for (var i = 0; i < heads.length; ++i) heads[i].removeAttribute('aria-sort');
    heads[column].setAttribute('aria-sort', falling ? 'descending' : 'ascending');
    var body = table.tBodies[0];
    Array.from(body.rows)
      .map(function (row, place) { return { row: row, place: place, key: key(row, column) }; })
      .sort(function (a, b) {
        var o = order(a.key, b.key);
        return (falling ? -o : o) || a.place - b.place;
      })
      .forEach(function (entry) { body.appendChild(entry.row); });
  }
  function quoted(text) {
    return /[",\n]/.test(text) ? '"' + text.replace(/"/g, '""') + '"' : text;
  }
  function csv(table) {
    return Array.from(table.rows).map(function (row) {
      return Array.from(row.cells).map(function (cell) {
        var value = cell.getAttribute('data-value');
        return quoted(value === null ? cell.textContent.trim() : value);
      }).join(',');
    }).join('\n') + '\n';
  }
  // The clipboard's own interface is missing on pages from a file in some browsers.
  function copy(text, done) {
    function byHand() {
      var area = document.createElement('textarea');
      area.value = text;
      document.body.appendChild(area);
      area.select();
      done(document.execCommand('copy'));
      area.remove();
    }
    if (navigator.clipboard && window.isSecureContext) {
      navigator.clipboard.writeText(text).then(function () { done(true); }, byHand);
    } else {
      byHand();
    }
  }
  function addCopyButton(table) {
    var button = document.createElement('button');
    button.type = 'button';
    button.className = 'copy';
    button.textContent = 'Copy table as CSV';
    button.addEventListener('click', function () {
      copy(csv(table), function (good) {
        button.textContent = good ? 'Copied' : 'Not copied: the browser refuses; use the CSV file beside the page';
        setTimeout(function () { button.textContent = 'Copy table as CSV'; }, 3000);
      });
    });
    table.parentNode.parentNode.insertBefore(button, table.parentNode);
  }
  function makeSortable(table) {
    Array.from(table.tHead.rows[0].cells).forEach(function (head, column) {
      var button = document.createElement('button');
      button.type = 'button';
      button.title = 'Sort by this column';
      while (head.firstChild) button.appendChild(head.firstChild);
      head.appendChild(button);
      button.addEventListener('click', function () { sortBy(table, column); });
    });
  }
  document.querySelectorAll('table').forEach(function (table) {
    if (table.tBodies[0].rows.length > 1) makeSortable(table);
    addCopyButton(table);
  });
})();
)js";
}

}  // namespace hybrid
