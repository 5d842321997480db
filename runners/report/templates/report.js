"use strict";
Bokeh.set_log_level("warn");
(async () => {
  const items = JSON.parse(document.getElementById("figures").textContent);
  const inks = JSON.parse(document.getElementById("inks").textContent);
  const night = window.matchMedia("(prefers-color-scheme: dark)");
  const plots = [];

  const paint = (plot, dark) => {
    const text = dark ? "#e3e8ed" : "#1c2128", line = dark ? "#59636e" : "#8b949e", grid = dark ? "#2c333b" : "#e1e5ea";
    for (const side of [plot.left, plot.below, plot.center, plot.renderers]) {
      for (const part of side) {
        const ink = inks[part.tags.find((tag) => tag in inks)];
        if (ink !== undefined) {
          const colour = ink[dark ? 1 : 0];
          for (const glyph of [part.glyph, part.muted_glyph, part.nonselection_glyph, part.selection_glyph]) {
            if (glyph === null || glyph === undefined || typeof glyph === "string") continue;
            for (const name of ["line_color", "fill_color"]) {
              if (name in glyph.properties && glyph[name] !== null) glyph[name] = { value: colour };
            }
          }
        } else if ("axis_label_text_color" in part.properties) {
          part.setv({ axis_label_text_color: text, major_label_text_color: text, axis_line_color: line,
            major_tick_line_color: line, minor_tick_line_color: line, axis_label_text_font_style: "normal" });
        } else if ("grid_line_color" in part.properties) {
          part.setv({ grid_line_color: grid });
        } else if (part.tags.includes("axis")) {
          part.setv({ line_color: line });
        }
      }
    }
  };
  const all = (dark) => plots.forEach((plot) => paint(plot, dark));

  for (const item of items) {
    const views = await Bokeh.embed.embed_item(item, document.getElementById(item.target_id));
    for (const { model } of views.roots) {
      if (model.id !== item.root_id) continue; // the document's own notifications are a root too
      plots.push(model);
      paint(model, night.matches);
    }
  }
  night.addEventListener("change", () => all(night.matches));
  window.addEventListener("beforeprint", () => all(false));
  window.addEventListener("afterprint", () => all(night.matches));
  document.documentElement.dataset.figures = String(plots.length);
})();
