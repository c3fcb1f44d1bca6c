"""Style sheet of a report: light or dark by the reader's setting, on paper always light."""

STYLE = """
:root { color-scheme: light dark; --ink:#1a1d21; --soft:#5b636e; --line:#d9dde3; --page:#fbfbfc; --card:#fff;
  --accent:#0b62b8; --good:#1b7f3b; --rim:#b26a00; --bad:#b3261e; --left:#0369a1; --right:#c2410c; }
@media (prefers-color-scheme: dark) { :root { --ink:#e7e9ec; --soft:#a2abb6; --line:#343a42; --page:#121417;
  --card:#1b1e23; --accent:#7cb8ff; --good:#6bd08a; --rim:#f0b45a; --bad:#ff8a80; --left:#7dd3fc;
  --right:#fb923c; } }
* { box-sizing: border-box; }
body { margin:0; background:var(--page); color:var(--ink);
  font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif; }
main { max-width:1080px; margin:0 auto; padding:2rem 1.25rem 4rem; }
h1 { font-size:1.7rem; line-height:1.2; margin:0 0 .3rem; }
h2 { font-size:1.2rem; margin:0 0 .7rem; padding-bottom:.3rem; border-bottom:2px solid var(--line); }
h3 { font-size:1rem; margin:1.2rem 0 .4rem; }
section { margin-top:2.2rem; }
p { margin:.5rem 0; max-width:75ch; }
.under { color:var(--soft); margin:0 0 1rem; overflow-wrap:anywhere; }
nav { display:flex; flex-wrap:wrap; gap:.3rem 1rem; margin:1rem 0 0; font-size:.92rem; }
a { color:var(--accent); }
.tiles { display:grid; grid-template-columns:repeat(auto-fit,minmax(150px,1fr)); gap:.7rem; margin:1.2rem 0; }
.tile { background:var(--card); border:1px solid var(--line); border-radius:10px; padding:.7rem .9rem; }
.tile b { display:block; white-space:nowrap; font-size:1.35rem; font-variant-numeric:tabular-nums;
  line-height:1.25; }
.tile span { color:var(--soft); font-size:.85rem; }
.scroll { overflow-x:auto; margin:.7rem 0; }
table { border-collapse:collapse; width:100%; font-size:.92rem; background:var(--card); }
caption { text-align:left; color:var(--soft); padding:.3rem 0; }
th, td { text-align:left; vertical-align:top; padding:.4rem .6rem; border-bottom:1px solid var(--line); }
th { color:var(--soft); font-weight:600; }
th.n { text-align:right; }
td.n { text-align:right; font-variant-numeric:tabular-nums; white-space:nowrap; }
.table2 th.n { text-align:left; }
.table2 td:nth-child(3), .table2 td:nth-child(4) { white-space:nowrap; font-variant-numeric:tabular-nums;
  text-align:left; }
.table2 td:nth-child(4) { font-weight:650; }
.table2 td:nth-child(5) { color:var(--soft); font-size:.85rem; min-width:14rem; }
.absent { background:color-mix(in srgb, var(--rim) 12%, var(--card)); border-left:4px solid var(--rim);
  border-radius:4px; padding:.5rem .8rem; }
.absent span { color:var(--soft); }
.facts { display:grid; grid-template-columns:repeat(auto-fill,minmax(min(300px,100%),1fr)); gap:.1rem 1.4rem;
  margin:.6rem 0; }
.facts div { display:flex; justify-content:space-between; gap:1rem; border-bottom:1px dotted var(--line);
  padding:.15rem 0; }
.facts dt { color:var(--soft); }
.facts dd { margin:0; text-align:right; font-variant-numeric:tabular-nums; overflow-wrap:anywhere; }
.figures { display:grid; grid-template-columns:repeat(auto-fill,minmax(min(440px,100%),1fr)); gap:1rem;
  margin:1rem 0; }
figure { margin:0; background:var(--card); border:1px solid var(--line); border-radius:10px; padding:.6rem;
  break-inside:avoid; }
figure.broad { grid-column:1 / -1; }
figure img { display:block; width:100%; height:auto; border-radius:5px; background:#fff; }
figure svg { display:block; width:100%; height:auto; max-height:460px; }
figcaption { color:var(--soft); font-size:.88rem; padding:.45rem .2rem 0; }
svg text { fill:var(--soft); font:12px system-ui,sans-serif; }
svg.degrees text { font-size:var(--size); } svg.degrees * { vector-effect:non-scaling-stroke; }
.centred { fill:var(--good); } .rim { fill:var(--rim); } .refused { fill:var(--bad); }
.waiting { fill:var(--line); }
.left { stroke:var(--left); fill:var(--left); } .right { stroke:var(--right); fill:var(--right); }
.frame { fill:none; stroke:var(--soft); } .dashed { stroke-dasharray:5 4; }
.grid { stroke:var(--line); }
.area { fill-opacity:.1; stroke-width:1.6; }
footer { margin-top:3rem; color:var(--soft); font-size:.85rem; border-top:1px solid var(--line);
  padding-top:.8rem; }
@media (max-width:640px) { body { font-size:15px; } main { padding:1.2rem .8rem 3rem; }
  th, td { padding:.35rem .45rem; } .tile b { font-size:1.15rem; }
  .table2 thead { display:none; } .table2 tr { display:grid; grid-template-columns:1fr 1fr;
    border-bottom:1px solid var(--line); padding:.3rem 0; }
  .table2 td { border:0; padding:.1rem .5rem; } .table2 td:empty { display:none; }
  .table2 td:nth-child(1), .table2 td:nth-child(2), .table2 td:nth-child(5) { grid-column:1/-1; }
  .table2 td:nth-child(1) { font-weight:650; color:var(--soft); }
  .table2 td:nth-child(3)::before { content:"paper "; color:var(--soft); }
  .table2 td:nth-child(4)::before { content:"here "; color:var(--soft); font-weight:400; } }
@media print { :root { color-scheme:light; --ink:#000; --soft:#444; --line:#bbb; --page:#fff; --card:#fff;
  --accent:#000; --good:#1b7f3b; --rim:#b26a00; --bad:#b3261e; --left:#0369a1; --right:#c2410c; }
  body { font-size:10.5pt; } main { max-width:none; padding:0; } nav { display:none; }
  .figures { grid-template-columns:1fr 1fr; } tr, .tile { break-inside:avoid; } h2 { break-after:avoid; }
  .scroll { overflow:visible; } @page { margin:15mm; } }
"""
