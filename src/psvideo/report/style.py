"""How report.html looks: system fonts, no outside requests; colours after Okabe and Ito, each with a mark or a dash."""

STYLE = (
    """
:root{--ink:#1d2126;--soft:#5b6570;--paper:#fff;--card:#f5f6f8;--rule:#dcdfe4;--good:#00704f;--doubt:#8a5a00;--bad:#b3261e;
--c0:#0072b2;--c1:#c2500a;--c2:#00805c;--c3:#a3447f;--c4:#8a6d00;--c5:#2f8fc4;--c6:#4a4f57;--c7:#7a4fb5}
@media(prefers-color-scheme:dark){:root{--ink:#e7e9ec;--soft:#9aa4af;--paper:#15181c;--card:#1e2227;--rule:#343a42;
--good:#4fd1a5;--doubt:#f0b840;--bad:#ff8a7a;--c0:#56b4e9;--c1:#f08c3a;--c2:#2fc79a;--c3:#e08fc0;--c4:#f0e442;--c5:#8fd0f5;
--c6:#c3c9d1;--c7:#b79cf0}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);font:15px/1.5 system-ui,sans-serif}
main{max-width:1080px;margin:0 auto;padding:1.6rem 1.4rem 4rem}
header{display:flex;flex-direction:row-reverse;justify-content:space-between;align-items:baseline;gap:1rem}
h1{font-size:1.5rem;margin:0;overflow-wrap:anywhere}.made{color:var(--soft);margin:0;white-space:nowrap}
h2{font-size:1.05rem;margin:2.2rem 0 .7rem;padding-bottom:.25rem;border-bottom:1px solid var(--rule)}
i{font-style:normal;display:inline-block;width:1.2em;text-align:center}
.verdict{margin:1rem 0;padding:.9rem 1.2rem;background:var(--card);border-left:6px solid var(--tone);border-radius:4px}
.verdict .word{font-size:1.25rem;font-weight:650;margin:0;color:var(--tone)}
.verdict ul{margin:.2rem 0 0;padding-left:1.5rem}.soft{color:var(--soft);margin:.6rem 0 0}
.verdict ol{margin:.6rem 0 0;padding-left:1.5rem}.verdict li{margin:.35rem 0}
.verdict>p:last-child:not(.word){margin:.4rem 0 0}
.good{--tone:var(--good)}.doubtful{--tone:var(--doubt)}.bad{--tone:var(--bad)}.unknown{--tone:var(--soft)}
table{border-collapse:collapse}th{text-align:left;font-weight:600}
td,th{padding:.28rem 1rem .28rem 0;border-bottom:1px solid var(--rule);vertical-align:top}
.lines{width:100%}.takes{margin:1rem 0 2rem}.takes td:last-child{width:100%}.lines th{white-space:nowrap}
.grade{color:var(--tone);white-space:nowrap;font-weight:600}
.facts th{white-space:nowrap;color:var(--soft);font-weight:500}.facts td{overflow-wrap:anywhere}
.figures td,.figures th{font-variant-numeric:tabular-nums}.wide{overflow-x:auto}
figure{margin:1rem 0}figcaption{color:var(--soft);font-size:.87rem}img{max-width:100%;height:auto;border-radius:3px}
.grid4{display:grid;grid-template-columns:repeat(auto-fill,minmax(250px,1fr));gap:.8rem 1.2rem}.grid4 figure{margin:0}
.grid2{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(480px,100%),1fr));gap:.4rem 1.6rem}
.grid4 img{width:100%;image-rendering:auto}
svg{width:100%;height:auto;max-width:820px;display:block;overflow:visible}
svg text{fill:var(--soft);font:11px system-ui,sans-serif}svg .grid{stroke:var(--rule);stroke-width:1}
svg path,svg line{fill:none;stroke-width:1.8}svg .area{fill:var(--c0);opacity:.75;stroke:none}svg .clip{fill:var(--bad)}
"""
    + "".join(
        f".s{n}{{stroke:var(--c{n})}}svg .f{n}{{fill:var(--c{n});opacity:.25;stroke:none}}svg .p{n}{{fill:var(--c{n})}}"
        for n in range(8)
    )
    + """
details summary{cursor:pointer;color:var(--soft);margin:.8rem 0 .4rem}
@media(max-width:600px){.lines tr{display:grid;grid-template-columns:auto 1fr;border-bottom:1px solid var(--rule)}
.lines td,.lines th{border:0}.lines td:last-child{grid-column:1/-1;padding-top:0}.grid2 svg text{font-size:15px}
.figures{font-size:.74rem}.figures td,.figures th{padding-right:.3rem}}
@media print{main{max-width:none}section{break-inside:avoid}}
"""
)
