// What the rest of the page, and a script that measures it, may call.

// brushes of the front as limits: levels of vehicles from above, factors from both sides
function limitsFromBrushes(brushes) {
  session.lower.set(data.lower);
  session.upper.set(data.upper);
  let taken = 0;
  for (const [axis, [low, high]] of brushes) {
    const k = names.indexOf(axis.name), v = vehicles.findIndex(({ name }) => axis.name === `${name} level`);
    if (k >= 0) {
      session.lower[k] = Math.max(data.lower[k], atStep(axis, low));
      session.upper[k] = Math.min(data.upper[k], atStep(axis, high));
      taken++;
    } else if (v >= 0) {
      session.limits.mean[v] = atStep(axis, high);
      taken++;
    }
  }
  remember();
  redraw();
  byId("live-said").textContent = taken ? `${taken} ${taken > 1 ? "brushes are limits" : "brush is a limit"} of an improvement now.` : "No brush on a factor or on the level of a vehicle: the ranges are whole again.";
  byId("live").scrollIntoView();
}

return {
  session, model, price, data, timing, stated, take, limitsFromBrushes, fillStarts,
  start: (design) => { moveTo(ofFront(design)); byId("live").scrollIntoView(); },
  set: (x) => { session.x = Float64Array.from(x); redraw(); },
  refresh: rebuild,
};
