// A robot that can be turned: wires coloured by tension, the platform where it was sent, and where creep takes it.
"use strict";
(() => {
  const SIZE = 460, MARGIN = 46, NAMES = ["x", "y", "z"];
  const LOW = [48, 80, 109], HIGH = [200, 85, 61];  // colours of the least and the greatest tension
  const make = (name, attributes, text) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const key in attributes) element.setAttribute(key, attributes[key]);
    if (text !== undefined) element.textContent = text;
    return element;
  };
  const start = figure => {
    const scene = JSON.parse(figure.querySelector("script").textContent), svg = figure.querySelector("svg");
    const poses = scene.drifted || [], magnify = scene.exaggeration || 1;
    const enlarged = i => scene.platform.map((p, k) => p.map((v, a) => v + magnify * (poses[i][k][a] - v)));
    const all = scene.exits.concat(scene.platform, ...poses.map((_, i) => enlarged(i)));
    const low = NAMES.map((_, a) => Math.min(...all.map(p => p[a]))), high = NAMES.map((_, a) => Math.max(...all.map(p => p[a])));
    const middle = low.map((v, a) => (v + high[a]) / 2), span = Math.hypot(...low.map((v, a) => high[a] - v)) || 1;
    const flat = low.findIndex((v, a) => high[a] - v < 1e-6 * span);
    // a planar robot is looked at squarely, any other from a corner
    let turn = [-150, -90, -90][flat] ?? -60, rise = flat === 2 ? 90 : flat >= 0 ? 0 : 22, moment = Math.max(poses.length - 1, 0);
    if (flat === 0) turn = 0;
    const project = p => {
      const a = turn * Math.PI / 180, e = rise * Math.PI / 180, [x, y, z] = p.map((v, i) => v - middle[i]);
      const right = -Math.sin(a) * x + Math.cos(a) * y, out = Math.cos(a) * x + Math.sin(a) * y;
      return [right, Math.cos(e) * z - Math.sin(e) * out];
    };
    const corner = k => low.map((v, a) => (k >> a) & 1 ? high[a] : v);
    let scale = 1, centre = [0, 0];
    const fit = () => {  // the frame fills the picture however it is turned
      const seen = [0, 1, 2, 3, 4, 5, 6, 7].map(k => project(corner(k))), range = k => [Math.min(...seen.map(q => q[k])), Math.max(...seen.map(q => q[k]))];
      const [u, v] = [range(0), range(1)];
      scale = Math.min((SIZE - 2 * MARGIN) / (u[1] - u[0] || 1), (SIZE - 2 * MARGIN) / (v[1] - v[0] || 1));
      centre = [(u[0] + u[1]) / 2, (v[0] + v[1]) / 2];
    };
    const at = p => {
      const [u, v] = project(p);
      return [SIZE / 2 + scale * (u - centre[0]), SIZE / 2 - scale * (v - centre[1])].map(x => Math.round(100 * x) / 100);
    };
    const line = (p, q, attributes) => {
      const [a, b] = [at(p), at(q)];
      svg.append(make("line", {x1: a[0], y1: a[1], x2: b[0], y2: b[1], ...attributes}));
    };
    const body = (points, colour) => {
      for (const [i, j] of scene.edges) line(points[i], points[j], {stroke: colour, "stroke-width": 2.4, "stroke-linecap": "round"});
      for (const p of points) {
        const [x, y] = at(p);
        svg.append(make("circle", {cx: x, cy: y, r: 3.2, fill: colour}));
      }
    };
    const tensions = i => (scene.tensions_N || [])[i] || null;
    const known = (scene.tensions_N || []).flat().filter(t => t !== null);
    const least = Math.min(...known), most = Math.max(...known);
    const colour = t => {
      const share = most > least ? (t - least) / (most - least) : 0.5;
      return `rgb(${LOW.map((v, i) => Math.round(v + share * (HIGH[i] - v))).join(",")})`;
    };
    const frame = () => {
      for (let k = 0; k < 8; k++) for (let a = 0; a < 3; a++)
        if (!((k >> a) & 1) && a !== flat) line(corner(k), corner(k | 1 << a), {stroke: "#d5dade", "stroke-width": 1});
      const reach = 0.12 * span;
      NAMES.forEach((name, a) => {
        if (a === flat) return;
        const tip = low.map((v, b) => a === b ? v + reach : v), label = low.map((v, b) => a === b ? v + 1.25 * reach : v);
        line(low, tip, {stroke: "#59636c", "stroke-width": 1.6});
        const [x, y] = at(label);
        svg.append(make("text", {x, y: y + 4, "text-anchor": "middle", class: "axis"}, name));
      });
    };
    const draw = () => {
      fit();
      svg.replaceChildren();
      frame();
      const now = poses.length ? enlarged(moment) : null, pull = tensions(moment);
      scene.exits.forEach((exit, w) => {
        if (now) line(exit, now[w], {stroke: "#c8553d", "stroke-width": 0.9, "stroke-dasharray": "2 3"});
        const slack = pull && !(pull[w] > 0);
        const style = {stroke: pull ? colour(pull[w]) : "#59636c", "stroke-width": 2, ...(slack && {"stroke-dasharray": "6 4"})};
        svg.append(make("polyline", {points: scene.wires[w].map(p => at(p).join()).join(" "), fill: "none", ...style}));
      });
      body(scene.platform, "#30506d");
      if (now) body(now, "#c8553d");
      const heart = at(middle);
      scene.exits.forEach((exit, w) => {
        const [x, y] = at(exit);
        svg.append(make("rect", {x: x - 3.5, y: y - 3.5, width: 7, height: 7, fill: "#1d2226"}));
        const up = y < heart[1] || scene.exits.every(e => Math.abs(at(e)[1] - heart[1]) < 1);
        const side = x < heart[0] - 20 ? "start" : x > heart[0] + 20 ? "end" : "middle";
        const alike = scene.exits.slice(0, w).filter(e => Math.hypot(at(e)[0] - x, at(e)[1] - y) < 26).length;
        const pulled = pull ? pull[w] > 0 ? `: ${Number(pull[w].toPrecision(3))} N` : ": slack" : "";
        const move = {start: -8, end: 8, middle: 0}[side];
        svg.append(make("text", {x: x + move, y: y + (up ? -9 - 13 * alike : 18 + 13 * alike), "text-anchor": side, class: "wire"}, `${w + 1}${pulled}`));
      });
    };
    for (const button of figure.querySelectorAll("button")) button.addEventListener("click", () => {
      turn += Number(button.dataset.turn || 0);
      rise = Math.max(-90, Math.min(90, rise + Number(button.dataset.rise || 0)));
      draw();
    });
    const slider = figure.querySelector("input"), shown = figure.querySelector("output");
    const say = () => { if (shown) shown.textContent = scene.times[moment]; };
    if (slider) slider.addEventListener("input", () => { moment = Number(slider.value); say(); draw(); });
    let held = null;
    svg.addEventListener("pointerdown", event => { held = [event.clientX, event.clientY]; svg.setPointerCapture(event.pointerId); });
    svg.addEventListener("pointermove", event => {
      if (!held) return;
      turn -= 0.5 * (event.clientX - held[0]);
      rise = Math.max(-90, Math.min(90, rise + 0.5 * (event.clientY - held[1])));
      held = [event.clientX, event.clientY];
      draw();
    });
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { held = null; });
    say();
    draw();
  };
  document.querySelectorAll("figure.view").forEach(start);
})();
