// The robot from the side and from above, as SVG; lengths in m, drawn 1000 to the metre.

const MM = 1000, SVG = "http://www.w3.org/2000/svg";

// What a failing run computes in its last steps may be anything; drawing ends at so many m.
const FAR = 1e4;

function near(value) { return Number.isFinite(value) ? Math.max(-FAR, Math.min(FAR, value)) : 0; }

function svg(parent, name, attributes) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent.append(element);
  return element;
}

function ink(color, alpha) { return {stroke: color, "stroke-opacity": alpha, "vector-effect": "non-scaling-stroke"}; }

class Robots {
  constructor(robots, samples) {
    document.getElementById("robot").hidden = false;
    this.robots = robots.map(robot => {
      const series = Object.fromEntries(Object.entries(robot.series).map(([k, i]) => [k, samples.series[i]]));
      return {...robot, series};
    });
    this.makeSide(document.getElementById("side"));
    this.makeAbove(document.getElementById("above"));
  }

  // Each robot with its own ground, which moves below it; its place in the picture says nothing, so several stand apart.
  makeSide(view) {
    const several = this.robots.length > 1, reach = 1.12 * Math.max(...this.robots.map(r => r.wheel_radius + r.height)) * MM;
    view.setAttribute("viewBox", `${-1.5 * reach} ${-1.06 * reach} ${3 * reach} ${1.42 * reach}`);
    this.gap = Math.min(1.1 * reach, 2.6 * reach / this.robots.length);
    this.tick = 0.1 * MM;
    const count = Math.ceil(3 * reach / this.tick);
    for (const robot of this.robots) {
      const r = robot.wheel_radius * MM, h = robot.height * MM, w = 0.07 * MM, color = robot.color;
      robot.side = svg(view, "g", {class: "side"});
      robot.ground = svg(robot.side, "g", {});
      const half = several ? this.gap / 2 : 9 * reach, marks = several ? Math.floor(half / this.tick) : count;
      robot.floor = svg(robot.ground, "g", {class: "floor"});
      svg(robot.floor, "line", {x1: -half, x2: half, y1: 0, y2: 0, ...ink("#8a8a8a", 1), "stroke-width": 1.5});
      robot.ticks = svg(robot.floor, "g", {});
      for (let k = -marks; k <= marks; k++) {
        svg(robot.ticks, "line", {x1: k * this.tick, x2: k * this.tick - 12, y1: 0, y2: 14, ...ink("#b5b5b5", 1), "stroke-width": 1});
      }
      const group = svg(robot.ground, "g", {transform: `translate(0 ${-r})`, class: "robot"});
      robot.body = svg(group, "g", {class: "body"});
      svg(robot.body, "rect", {x: -w / 2, y: -h, width: w, height: 0.96 * h, rx: 7, fill: several ? color : "#dfe9f3", "fill-opacity": several ? 0.16 : 1, ...ink(color, 1), "stroke-width": 1.8});
      svg(robot.body, "line", {x1: -w / 2, x2: w / 2, y1: -0.72 * h, y2: -0.72 * h, ...ink(color, 0.6), "stroke-width": 1.2});
      svg(robot.body, "circle", {cx: w / 4, cy: -0.86 * h, r: 5, fill: color});
      robot.wheel = svg(group, "g", {class: "wheel"});
      svg(robot.wheel, "circle", {r, fill: "#fff", "fill-opacity": several ? 0.5 : 1, ...ink(several ? color : "#222", 1), "stroke-width": 2.4});
      for (const angle of [0, 60, 120]) svg(robot.wheel, "line", {x1: -0.86 * r, x2: 0.86 * r, y1: 0, y2: 0, transform: `rotate(${angle})`, ...ink("#9a9a9a", 1), "stroke-width": 1});
      svg(robot.wheel, "circle", {r: 0.13 * r, fill: "#222"});
      robot.push = svg(group, "path", {fill: "none", ...ink("#c23b4e", 1), "stroke-width": 2.5});
    }
    const label = svg(view, "text", {x: 1.44 * reach, y: -0.93 * reach, "text-anchor": "end", "font-size": 0.085 * reach, class: "pitches"});
    for (const robot of this.robots) robot.label = svg(label, "tspan", {fill: several ? robot.color : "#767676", dx: 0.05 * reach});
    this.stand(several);
  }

  // Put the robots apart, or over each other.
  stand(apart) {
    this.robots.forEach((robot, i) => {
      robot.side.setAttribute("transform", `translate(${apart ? (i - (this.robots.length - 1) / 2) * this.gap : 0} 0)`);
      if (this.robots.length > 1) robot.floor.setAttribute("visibility", apart || i === 0 ? "inherit" : "hidden");
    });
  }

  makeAbove(view) {
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const {series: {x, y}} of this.robots) {
      for (const v of x.values) { if (v < left && v > -FAR) left = v; if (v > right && v < FAR) right = v; }
      for (const v of y.values) { if (v < low && v > -FAR) low = v; if (v > high && v < FAR) high = v; }
    }
    if (!(right - left >= 0)) [left, right] = [0, 0];
    if (!(high - low >= 0)) [low, high] = [0, 0];
    const size = Math.max(0.45, 0.8 * (right - left + 0.3) * 180 / 300, high - low + 0.34), middle = [(left + right) / 2, (low + high) / 2];
    const wide = Math.max(size * 2.2, right - left + 0.4);
    view.setAttribute("viewBox", `${(middle[0] - wide / 2) * MM} ${(-middle[1] - size / 2) * MM} ${wide * MM} ${size * MM}`);
    const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100].find(s => wide / s < 14) ?? wide / 8;
    const grid = svg(view, "g", {});
    const span = 1.5 * Math.max(wide, size);
    for (let k = Math.floor((middle[0] - span) / step); k * step < middle[0] + span; k++) svg(grid, "line", {x1: k * step * MM, x2: k * step * MM, y1: (-middle[1] - span) * MM, y2: (-middle[1] + span) * MM, ...ink("#e2e4e6", 1), "stroke-width": 1});
    for (let k = Math.floor((middle[1] - span) / step); k * step < middle[1] + span; k++) svg(grid, "line", {y1: -k * step * MM, y2: -k * step * MM, x1: (middle[0] - span) * MM, x2: (middle[0] + span) * MM, ...ink("#e2e4e6", 1), "stroke-width": 1});
    document.querySelector("#above + figcaption").textContent = `above, grid ${Number(step.toPrecision(3))} m`;
    for (const robot of this.robots) {
      const {x, y} = robot.series, every = Math.max(1, Math.floor(x.times.count / 1500)), points = [];
      for (let i = 0; i < x.times.count; i += every) points.push(`${(near(x.values[i]) * MM).toFixed(1)},${(-near(y.values[i]) * MM).toFixed(1)}`);
      svg(view, "polyline", {points: points.join(" "), fill: "none", ...ink(robot.color, 0.45), "stroke-width": 1.5});
    }
    for (const robot of this.robots) {
      const r = robot.wheel_radius * MM, t = robot.track_width / 2 * MM, several = this.robots.length > 1;
      robot.top = svg(view, "g", {class: "top"});
      for (const side of [-1, 1]) svg(robot.top, "rect", {x: -r, y: side * t - 10, width: 2 * r, height: 20, rx: 6, fill: several ? robot.color : "#444", "fill-opacity": several ? 0.5 : 1});
      robot.roof = svg(robot.top, "rect", {x: -35, y: -0.8 * t, width: 70, height: 1.6 * t, rx: 8, fill: several ? robot.color : "#dfe9f3", "fill-opacity": several ? 0.16 : 1, ...ink(robot.color, 1), "stroke-width": 1.8});
      svg(robot.top, "path", {d: `M ${r + 12} 0 l -16 -10 v 20 z`, fill: robot.color});
    }
  }

  // A robot is shown while its log lasts.
  show(time) {
    for (const robot of this.robots) {
      const {pitch, wheel, yaw, x, y, push, slope} = robot.series;
      const shown = pitch.covers(time), tilt = slope ? near(slope.between(time)) : 0;
      const [angle, turn, course, along, aside] = [pitch, wheel, yaw, x, y].map(series => near(series.between(time)));
      for (const part of [robot.side, robot.top]) part.setAttribute("visibility", shown ? "visible" : "hidden");
      robot.ground.setAttribute("transform", `rotate(${-tilt})`);
      robot.ticks.setAttribute("transform", `translate(${-((turn * robot.wheel_radius * MM) % this.tick)} 0)`);
      robot.body.setAttribute("transform", `rotate(${angle + tilt})`);
      robot.wheel.setAttribute("transform", `rotate(${turn * 180 / Math.PI})`);
      robot.top.setAttribute("transform", `translate(${along * MM} ${-aside * MM}) rotate(${-course})`);
      robot.roof.setAttribute("x", -35 + Math.sin(angle * Math.PI / 180) * robot.height * MM / 2);
      const force = push ? push.value(time) : 0, length = Math.sign(force) * Math.min(110, 30 + 8 * Math.abs(force)), h = robot.push_height * MM;
      robot.push.setAttribute("d", force ? `M ${-length - Math.sign(force) * 40} ${-h} h ${length} m ${-Math.sign(force) * 12} -9 l ${Math.sign(force) * 12} 9 l ${-Math.sign(force) * 12} 9` : "");
      robot.label.textContent = shown ? `${number(pitch.between(time), 10)}°` : "–";
    }
  }
}
