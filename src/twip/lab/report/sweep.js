// The pictures of a sweep: maps over two axes, and bars with intervals; hovering tells the numbers.

const LOW = [209, 74, 92], HIGH = [209, 232, 245];
const SCALE = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

function mixed(colors, share) {
  const at = Math.min(1, Math.max(0, share)) * (colors.length - 1), i = Math.min(colors.length - 2, Math.floor(at));
  return `rgb(${colors[i].map((c, k) => Math.round(c + (at - i) * (colors[i + 1][k] - c))).join(",")})`;
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

function place(title, note) {
  const section = document.createElement("section"), head = document.createElement("h2"), text = document.createElement("p");
  const drawn = document.createElement("div");
  head.textContent = title;
  text.textContent = note;
  text.className = "note";
  drawn.className = "drawn";
  section.append(head, text, drawn);
  document.getElementById("drawn").append(section);
  return drawn;
}

function show(figure, into) {
  const element = document.createElement("div");
  into.append(element);
  return Bokeh.Plotting.show(figure, element);
}

async function map(picture) {
  const into = place(picture.title, picture.note);
  for (const panel of picture.panels) {
    const factors = list => new Bokeh.FactorRange({factors: list});
    const figure = new Bokeh.Plotting.figure({
      x_range: factors(picture.across), y_range: factors(picture.down), width: picture.panels.length > 1 ? 410 : 640, height: 360,
      title: panel.label || null, toolbar_location: null, tools: [], outline_line_color: null,
    });
    const color = panel.cells.shade.map(s => s === null ? "#f1f1f1" : mixed(picture.share ? [LOW, HIGH] : SCALE, s));
    const source = new Bokeh.ColumnDataSource({data: {...panel.cells, color}});
    figure.rect({field: "x"}, {field: "y"}, 1, 1, {source, fill_color: {field: "color"}, line_color: "white", line_width: 1});
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
