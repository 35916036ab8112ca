"use strict";
// Tables are put in order by a click on their head; figures tell their values and are enlarged by a click.
(() => {
  // "1,200", "0.4 deg/s", "<= 1.5 m" and "24.0 to 8.0" are put in order by their first number
  const number = cell => {
    const text = cell.textContent.trim().replace(/\u2212/g, "-").replace(/^[<>=\u2264\u2265\u00b1~\s]+/, "");
    const found = text.match(/^[-+]?\d[\d,]*(\.\d+)?(e[-+]?\d+)?/);
    return found ? Number(found[0].replace(/,/g, "")) : null;
  };
  const blank = cell => ["", "\u2013"].includes(cell.textContent.trim());
  for (const table of document.querySelectorAll("table")) {
    const head = table.rows[0];
    if (!head || table.rows.length < 3) continue;
    [...head.cells].forEach((cell, column) => {
      cell.tabIndex = 0;
      cell.title = "sort";
      cell.classList.add("sortable");
      const sort = () => {
        const down = cell.dataset.order === "up";
        for (const other of head.cells) delete other.dataset.order;
        cell.dataset.order = down ? "down" : "up";
        const rows = [...table.rows].slice(1);
        rows.sort((a, b) => {
          const one = a.cells[column], other = b.cells[column];
          if (blank(one) || blank(other)) return blank(one) - blank(other); // at the end, whichever way
          const x = number(one), y = number(other);
          const order = (x !== null && y !== null ? x - y : x !== null ? -1 : y !== null ? 1 : 0)
            || one.textContent.localeCompare(other.textContent, undefined, { numeric: true });
          return down ? -order : order;
        });
        for (const row of rows) row.parentNode.appendChild(row);
      };
      cell.addEventListener("click", sort);
      cell.addEventListener("keydown", event => { if (event.key === "Enter") sort(); });
    });
  }

  // a PNG is a row of chunks: length, name, content, check; ours is a tEXt that starts with "discsim" and a zero
  const values = image => {
    const raw = atob(image.src.split(",")[1]);
    const length = at => (raw.charCodeAt(at) << 24 | raw.charCodeAt(at + 1) << 16
      | raw.charCodeAt(at + 2) << 8 | raw.charCodeAt(at + 3)) >>> 0;
    for (let at = 8; at + 8 < raw.length; at += 12 + length(at)) {
      const text = raw.slice(at + 8, at + 8 + length(at));
      if (raw.slice(at + 4, at + 8) === "tEXt" && text.startsWith("discsim\0")) return JSON.parse(text.slice(8));
    }
    return [];
  };

  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  const dot = document.createElement("div");
  dot.className = "dot";
  dot.hidden = true;
  document.body.append(tip, dot);
  const hide = () => { tip.hidden = dot.hidden = true; };

  const point = (image, curves, event) => {
    const box = image.getBoundingClientRect();
    let best = null, least = 24;
    for (const curve of curves) for (const at of curve.at) {
      const far = Math.hypot(at[0] * box.width - (event.clientX - box.left), at[1] * box.height - (event.clientY - box.top));
      if (far < least) { least = far; best = [curve, at]; }
    }
    if (!best) return hide();
    const [curve, at] = best;
    tip.textContent = `${curve.name ? curve.name + ": " : ""}${curve.x || "x"} ${at[2]}, ${curve.y || "y"} ${at[3]}`;
    tip.hidden = dot.hidden = false;
    const x = box.left + at[0] * box.width, y = box.top + at[1] * box.height;
    dot.style.left = `${x}px`; dot.style.top = `${y}px`;
    tip.style.left = `${Math.max(4, Math.min(x + 12, innerWidth - tip.offsetWidth - 8))}px`;
    tip.style.top = `${Math.max(4, y - tip.offsetHeight - 10)}px`;
  };

  const enlarge = (image, curves) => {
    const screen = document.createElement("div");
    screen.className = "screen";
    const copy = image.cloneNode();
    screen.append(copy);
    document.body.append(screen);
    let scale = Math.min(innerWidth / image.naturalWidth, innerHeight / image.naturalHeight) * 0.95;
    let x = (innerWidth - scale * image.naturalWidth) / 2, y = (innerHeight - scale * image.naturalHeight) / 2;
    const place = () => { copy.style.transform = `translate(${x}px, ${y}px) scale(${scale})`; };
    const close = () => { screen.remove(); hide(); removeEventListener("keydown", key); };
    const key = event => { if (event.key === "Escape") close(); };
    place();
    let held = null, moved = false;
    screen.addEventListener("wheel", event => {
      event.preventDefault();
      const factor = Math.exp(-0.0015 * event.deltaY);
      x = event.clientX - factor * (event.clientX - x); y = event.clientY - factor * (event.clientY - y);
      scale *= factor; hide(); place();
    }, { passive: false });
    screen.addEventListener("pointerdown", event => { held = [event.clientX - x, event.clientY - y]; moved = false; });
    screen.addEventListener("pointermove", event => {
      if (!held) return point(copy, curves, event);
      moved = true; hide(); x = event.clientX - held[0]; y = event.clientY - held[1]; place();
    });
    screen.addEventListener("pointerup", () => { held = null; if (!moved) close(); });
    addEventListener("keydown", key);
  };

  for (const image of document.querySelectorAll("figure img")) {
    const curves = values(image);
    image.dataset.curves = curves.length;
    image.draggable = false;
    image.title = "";
    image.addEventListener("pointermove", event => point(image, curves, event));
    image.addEventListener("pointerleave", hide);
    image.addEventListener("click", () => enlarge(image, curves));
  }
  document.body.dataset.ready = "yes";
})();
