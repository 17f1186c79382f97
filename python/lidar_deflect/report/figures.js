"use strict";
(() => {
  // On A4 between the margins of style.css, so that two figures fit on a page.
  const PRINT = { width: 680, height: 385 };
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const plots = [...document.querySelectorAll(".plot")];
  const options = { responsive: true, displaylogo: false, plotlyServerURL: "", toImageButtonOptions: { scale: 2 } };
  const ink = (isDark) => ({ "font.color": isDark ? "#c5cdd5" : "#3b444d" });

  for (const plot of plots) {
    const figure = JSON.parse(plot.nextElementSibling.textContent);
    figure.layout.font = { ...figure.layout.font, color: ink(dark.matches)["font.color"] };
    figure.layout.autosize = true;
    Plotly.newPlot(plot, figure.data, figure.layout, options);
  }
  dark.addEventListener("change", () => plots.forEach((plot) => Plotly.relayout(plot, ink(dark.matches))));
  window.addEventListener("beforeprint", () =>
    plots.forEach((plot) => {
      const height = Math.min(PRINT.height, Number(plot.dataset.height));
      plot.style.minHeight = `${height}px`;
      Plotly.relayout(plot, { ...ink(false), width: PRINT.width, height, autosize: false });
    }));
  window.addEventListener("afterprint", () =>
    plots.forEach((plot) => {
      const height = Number(plot.dataset.height);
      plot.style.minHeight = `${height}px`;
      Plotly.relayout(plot, { ...ink(dark.matches), width: null, height, autosize: true });
    }));
})();
