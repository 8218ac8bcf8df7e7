"use strict";
// Plotly reads what it wrote on canvases back: said before it makes any, or browsers remark on it.
(() => {
  const context = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, how) {
    return context.call(this, kind, kind === "2d" ? { willReadFrequently: true, ...how } : how);
  };
})();
