"use strict";
(() => {
  // On A4 between the margins of style.css, so that two figures of usual height fit on a page.
  const PRINT = { width: 690, shrink: 0.75, least: 300 };
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const plots = [...document.querySelectorAll(".plot")];
  const options = { responsive: true, displaylogo: false, plotlyServerURL: "", toImageButtonOptions: { scale: 2 } };
  const ink = (isDark) => ({ "font.color": isDark ? "#c5cdd5" : "#3b444d" });
  let linking = false;

  // Figures of one link zoom together along x.
  const link = (plot) => {
    if (!plot.dataset.link) return;
    plot.on("plotly_relayout", (change) => {
      if (linking) return;
      const key = Object.keys(change).find((name) => /^xaxis\d*\.(range|autorange)/.test(name));
      if (!key) return;
      const axis = key.split(".")[0];
      const range = change[`${axis}.range`] || [change[`${axis}.range[0]`], change[`${axis}.range[1]`]];
      const update = {};
      linking = true;
      const others = plots.filter((other) => other !== plot && other.dataset.link === plot.dataset.link && other.drawn);
      Promise.all(others.map((other) => {
        const axes = Object.keys(other.layout).filter((name) => /^xaxis\d*$/.test(name));
        const own = { ...update };
        for (const name of axes) {
          if (change[`${axis}.autorange`]) own[`${name}.autorange`] = true;
          else own[`${name}.range`] = [...range];
        }
        return Plotly.relayout(other, own);
      })).finally(() => { linking = false; });
    });
  };

  const draw = (plot) => {
    if (plot.drawn) return;
    plot.drawn = true;
    const figure = JSON.parse(plot.nextElementSibling.textContent);
    figure.layout.font = { ...figure.layout.font, color: ink(dark.matches)["font.color"] };
    figure.layout.autosize = true;
    Plotly.newPlot(plot, figure.data, figure.layout, options).then(() => link(plot));
  };

  // A figure is drawn when it is about to be seen: an hour of test opens at once.
  const watch = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (entry.isIntersecting) { draw(entry.target); watch.unobserve(entry.target); }
    }
  }, { rootMargin: "800px" });
  plots.forEach((plot) => watch.observe(plot));
  window.drawAllFigures = () => plots.forEach(draw);

  const recolour = () => plots.filter((plot) => plot.drawn).forEach((plot) => Plotly.relayout(plot, ink(dark.matches)));
  dark.addEventListener("change", recolour);

  // Paper shows every fold but those of many figures, in ink on white.
  const folds = [...document.querySelectorAll("details")];
  const isLong = (fold) => fold.querySelectorAll(".plot").length > 12 || fold.querySelectorAll("tr").length > 400;
  window.addEventListener("beforeprint", () => {
    folds.forEach((fold) => { fold.wasOpen = fold.open; if (!isLong(fold)) fold.open = true; });
    plots.filter((plot) => !plot.closest("details:not([open])")).forEach((plot) => {
      draw(plot);
      const height = Math.max(PRINT.least, PRINT.shrink * Number(plot.dataset.height));
      plot.style.minHeight = `${height}px`;
      Plotly.relayout(plot, { ...ink(false), width: PRINT.width, height, autosize: false });
    });
  });
  window.addEventListener("afterprint", () => {
    folds.forEach((fold) => { fold.open = fold.wasOpen; });
    plots.filter((plot) => plot.drawn).forEach((plot) => {
      const height = Number(plot.dataset.height);
      plot.style.minHeight = `${height}px`;
      Plotly.relayout(plot, { ...ink(dark.matches), width: null, height, autosize: true });
    });
  });
})();
