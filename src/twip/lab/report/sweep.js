// The pictures of a sweep: maps over two axes, and bars with intervals; hovering tells the numbers.

// The colour at a share of the way along colours such as "#d55e00".
function mixed(colors, share) {
  const at = Math.min(1, Math.max(0, share)) * (colors.length - 1), i = Math.min(colors.length - 2, Math.floor(at));
  const part = (color, k) => parseInt(color.slice(1 + 2 * k, 3 + 2 * k), 16);
  return `rgb(${[0, 1, 2].map(k => Math.round(part(colors[i], k) + (at - i) * (part(colors[i + 1], k) - part(colors[i], k)))).join(",")})`;
}

function scale(into, {colors, ends}) {
  const line = document.createElement("p"), bar = document.createElement("span"), empty = document.createElement("span");
  line.className = "scale";
  bar.style.background = `linear-gradient(to right, ${colors.join(", ")})`;
  empty.className = "empty";
  line.append(ends[0], bar, ends[1], empty, "nothing to show");
  into.append(line);
}

function calm(figure) {
  for (const axis of [figure.xaxis, figure.yaxis]) {
    Object.assign(axis, {
      axis_line_color: null, minor_tick_line_color: null, major_tick_line_color: null, major_label_text_color: "#767676",
      major_label_text_font_size: "11px", axis_label_text_color: "#555", axis_label_text_font_size: "12px",
      axis_label_text_font_style: "normal",
    });
  }
  for (const grid of [figure.xgrid, figure.ygrid]) grid.grid_line_color = null;
}

function place(title, note, map = null) {
  const section = document.createElement("section"), head = document.createElement("h2"), text = document.createElement("p");
  const drawn = document.createElement("div");
  head.textContent = title;
  text.textContent = note;
  text.className = "note";
  drawn.className = "drawn";
  section.append(head, text);
  if (map) scale(section, map);
  section.append(drawn);
  document.getElementById("drawn").append(section);
  return drawn;
}

function show(figure, into) {
  const element = document.createElement("div");
  into.append(element);
  return Bokeh.Plotting.show(figure, element);
}

async function map(picture) {
  const into = place(picture.title, picture.note, picture);
  for (const panel of picture.panels) {
    const factors = list => new Bokeh.FactorRange({factors: list});
    const figure = new Bokeh.Plotting.figure({
      x_range: factors(picture.across), y_range: factors(picture.down), width: picture.panels.length > 1 ? 410 : 640, height: 360,
      title: panel.label || null, toolbar_location: null, tools: [], outline_line_color: null,
    });
    const color = panel.cells.shade.map(s => s === null ? "#fff" : mixed(picture.colors, s));
    const hatch = panel.cells.shade.map(s => s === null ? "right_diagonal_line" : "blank");
    const source = new Bokeh.ColumnDataSource({data: {...panel.cells, color, hatch}});
    figure.rect({field: "x"}, {field: "y"}, 1, 1, {
      source, fill_color: {field: "color"}, line_color: "white", line_width: 1,
      hatch_pattern: {field: "hatch"}, hatch_color: "#9a9a9a", hatch_scale: 8, hatch_weight: 1,
    });
    figure.add_tools(new Bokeh.HoverTool({tooltips: picture.told.map(([name, field]) => [name, `@${field}`])}));
    calm(figure);
    figure.xaxis.axis_label = picture.x;
    figure.yaxis.axis_label = picture.y;
    if (picture.across.length > 8) figure.xaxis.major_label_orientation = 0.9;
    await show(figure, into);
  }
}

async function bars(picture) {
  const into = place(picture.title, picture.note);
  const figure = new Bokeh.Plotting.figure({
    y_range: new Bokeh.FactorRange({factors: [...picture.bars.axis].reverse()}), width: 820, height: 70 + 34 * picture.bars.axis.length,
    toolbar_location: null, tools: [], outline_line_color: null,
  });
  const source = new Bokeh.ColumnDataSource({data: picture.bars});
  figure.hbar({field: "axis"}, 0.62, {field: "value"}, 0, {source, fill_color: "#1f6fb4", fill_alpha: 0.75, line_color: null});
  figure.segment({field: "low"}, {field: "axis"}, {field: "high"}, {field: "axis"}, {source, line_color: "#222", line_width: 1.4});
  figure.add_tools(new Bokeh.HoverTool({tooltips: [["axis", "@axis"], ["value", "@value{0.000}"], ["interval", "@low{0.000} to @high{0.000}"]]}));
  calm(figure);
  figure.xgrid.grid_line_color = "#ededed";
  await show(figure, into);
}

(async () => {
  const data = JSON.parse(document.getElementById("data").textContent);
  for (const picture of data.maps) await map(picture);
  for (const picture of data.rankings) await bars(picture);
  document.body.dataset.ready = "true";
})();
