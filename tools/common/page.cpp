// The style sheet and the script of every page are strings in this file. Text from outside passes
// through escaped() before it becomes HTML.
#include "tools/common/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "formats/base/utf8.hpp"

namespace nif::tools {
namespace {

constexpr std::string_view kStyle =
    R"(:root{color-scheme:light dark;--ink:#1b1f24;--soft:#5c6470;--line:#d8dce1;
--paper:#fff;--bad:#fdeaea;--mark:#0b62c4}
@media(prefers-color-scheme:dark){:root{--ink:#e6e8eb;--soft:#9aa3ad;--line:#343a42;--paper:#15181c;--bad:#47202a;
--mark:#78b4ff}}
*{box-sizing:border-box}
[hidden]{display:none!important}
body{font:15px/1.45 system-ui,sans-serif;margin:0 auto;max-width:110rem;padding:1.2rem clamp(.8rem,3vw,2.5rem);
color:var(--ink);background:var(--paper)}
h1{font-size:1.35rem;overflow-wrap:anywhere;margin:.2rem 0}
a{color:var(--mark)}
img{max-width:100%;height:auto;display:block;border-radius:4px}
.note{color:var(--soft);font-size:13px;overflow-wrap:anywhere}
.tools{display:flex;flex-wrap:wrap;gap:.6rem;margin:1rem 0 .6rem}
input,select,button{font:inherit;color:inherit;background:var(--paper);border:1px solid var(--line);border-radius:6px;
padding:.35rem .6rem}
input{flex:1 1 14rem;max-width:26rem}
:focus-visible{outline:2px solid var(--mark);outline-offset:1px}
table{border-collapse:collapse;width:100%}
th,td{padding:.4rem .6rem;text-align:left;vertical-align:top;border-bottom:1px solid var(--line)}
th{position:sticky;top:0;background:var(--paper);vertical-align:bottom;font-weight:600}
th button{border:0;padding:0;background:none;font-weight:600;text-align:inherit;cursor:pointer}
th[aria-sort=ascending] button::after{content:" \25b2"}
th[aria-sort=descending] button::after{content:" \25bc"}
.number{text-align:right;font-variant-numeric:tabular-nums}
td.number{white-space:nowrap}
.failed{background:var(--bad)}
td:first-child{min-width:11rem;overflow-wrap:anywhere}
@media(max-width:52rem){table,tbody,tr,td{display:block}thead{display:none}
tr{border-bottom:2px solid var(--line);padding:.5rem 0}td{border:0;padding:.1rem .2rem}
td.number{display:flex;justify-content:space-between}
td.number::before{content:attr(data-name);color:var(--soft)}}
@media(min-width:52.01rem){.narrow{display:none}}
h2{font-size:1.1rem;margin:1.8rem 0 0}
figure{margin:.6rem 0}
figcaption{color:var(--soft);font-size:13px}
.row{display:grid;grid-template-columns:repeat(4,minmax(0,20rem));gap:.4rem}
@media(max-width:40rem){.row{grid-template-columns:1fr 1fr}}
.gallery{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,22rem),1fr));gap:.4rem 1.2rem}
.gallery .row{grid-template-columns:1fr 1fr}
img.plot{max-width:min(100%,60rem)}
.bar{display:grid;grid-template-columns:minmax(6rem,11rem) minmax(4rem,24rem) auto;gap:0 .6rem;align-items:center}
.track{background:var(--line);border-radius:3px}
.track i{display:block;height:.8rem;min-width:1px;background:var(--mark);border-radius:3px}
@media(max-width:40rem){.bar{grid-template-columns:1fr auto;margin:.4rem 0}.track{grid-row:2;grid-column:1/3}}
svg{width:100%;max-width:640px;border:1px solid var(--line);border-radius:4px}
polyline{fill:none;stroke:var(--mark);stroke-width:1.5;vector-effect:non-scaling-stroke}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.1rem 1rem}
dt{color:var(--soft)}
dd{margin:0;overflow-wrap:anywhere}
)";

// Sorts and filters each table. Tables are found by their class; the controls are placed before them. Small
// tables need none.
constexpr std::string_view kScript =
    R"(const kFew=8;for(const table of document.querySelectorAll('table.sorted')){
const body=table.tBodies[0],heads=[...table.tHead.rows[0].cells],tools=table.previousElementSibling;
const [filter,select,count]=[tools.querySelector('input'),tools.querySelector('select'),tools.querySelector('output')];
const value=(row,i)=>row.cells[i].dataset.value;
const sort=(i,down)=>{const number=heads[i].classList.contains('number');
heads.forEach((head,k)=>k===i?head.setAttribute('aria-sort',down?'descending':'ascending'):head.removeAttribute('aria-sort'));
const rows=[...body.rows];
rows.sort((a,b)=>{const x=value(a,i),y=value(b,i);
if(x===''||y==='')return (x==='')-(y==='');
const order=number?x-y:x.localeCompare(y,undefined,{numeric:true});return down?-order:order});
body.append(...rows)};
heads.forEach((head,i)=>{const button=head.querySelector('button');
if(button)button.onclick=()=>sort(i,head.getAttribute('aria-sort')==='ascending')});
select.onchange=()=>{const [i,down]=select.value.split(' ');sort(+i,down==='1')};
filter.oninput=()=>{const words=filter.value.toLowerCase().split(/\s+/).filter(Boolean);let shown=0;
for(const row of body.rows){const text=row.cells[0].textContent.toLowerCase();
row.hidden=!words.every(word=>text.includes(word));shown+=!row.hidden}
count.textContent=words.length?shown+' of '+body.rows.length:''};
tools.hidden=body.rows.length<kFew}
)";

std::string_view style_of(PageTable::Kind kind) {
  return kind == PageTable::Kind::number ? " class=\"number\"" : "";
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string safe;
  while (!text.empty()) {
    const size_t bytes = utf8_sequence(text);
    const std::string_view one = text.substr(0, std::max<size_t>(1, bytes));
    text.remove_prefix(one.size());
    const auto byte = static_cast<unsigned char>(one[0]);
    if (one == "&") {
      safe += "&amp;";
    } else if (one == "<") {
      safe += "&lt;";
    } else if (one == "\"") {
      safe += "&quot;";
    } else if (one == ">") {
      safe += "&gt;";
    } else if (bytes == 0 || byte < 0x20 || one == "\uFFFE" || one == "\uFFFF") {
      safe += '?';
    } else {
      safe += one;
    }
  }
  return safe;
}

std::string data_address(std::string_view type, std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out = fmt::format("data:{};base64,", type);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kDigits[word >> (18 - 6 * k) & 63];
  }
  return out;
}

std::string png_address(std::string_view png) { return data_address("image/png", png); }

std::string html_page(std::string_view title, std::string_view body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><link rel=\"icon\" "
      "href=\"data:,\">\n"
      "<title>{}</title><style>{}</style></head>\n<body>\n{}\n<script>{}</script></body></html>\n",
      escaped(title), kStyle, body, kScript);
}

std::string html_section(std::string_view title, std::string_view about, const std::string& html) {
  return fmt::format("<section><h2>{}</h2>\n<p class=\"note\">{}</p>\n{}</section>\n", escaped(title),
                     escaped(about), html);
}

void PageBars::add(std::string_view name, double share, std::string_view said) {
  html_ += fmt::format(
      "<div class=\"bar\"><span>{}</span><span class=\"track\"><i "
      "style=\"width:{:.2f}%\"></i></span><span>{}</span></div>\n",
      escaped(name), 100 * std::clamp(share, 0.0, 1.0), escaped(said));
}

PageTable::PageTable(std::vector<Column> columns) : columns_(std::move(columns)) {}

void PageTable::row(std::string_view style) {
  rows_ += style.empty() ? "\n<tr>" : fmt::format("\n<tr class=\"{}\">", style);
  column_ = 0;
}

void PageTable::cell(std::string_view html, std::string_view value) {
  const Column& column = columns_[column_++];
  rows_ += fmt::format("<td{} data-name=\"{}\" data-value=\"{}\">{}</td>", style_of(column.kind),
                       escaped(column.name), escaped(value), html);
}

std::string PageTable::html() const {
  std::string heads, choices;
  for (size_t i = 0; i < columns_.size(); ++i) {
    const std::string name = escaped(columns_[i].name);
    if (columns_[i].kind == Kind::picture) {
      heads += fmt::format("<th scope=\"col\">{}</th>", name);
      continue;
    }
    heads += fmt::format("<th scope=\"col\"{}><button type=\"button\">{}</button></th>",
                         style_of(columns_[i].kind), name);
    choices += fmt::format(
        "<option value=\"{0} 0\">{1}, rising</option><option value=\"{0} 1\">{1}, falling</option>", i, name);
  }
  // The controls do nothing without scripts, so scripts make them visible.
  return fmt::format(
      "<div class=\"tools\" hidden><input type=\"search\" aria-label=\"Filter by words\" "
      "placeholder=\"Filter by words\">"
      "<select class=\"narrow\" aria-label=\"Sort by\"><option value=\"\" hidden>Sort by</option>{}</select>"
      "<output class=\"note\"></output></div>\n"
      "<table class=\"sorted\"><thead><tr>{}</tr></thead><tbody>{}\n</tbody></table>\n",
      choices, heads, rows_);
}

}  // namespace nif::tools
