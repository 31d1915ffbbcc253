// The map: tiles of the grid, and all that lies on it.
// @ts-check
/* global L */

const COLOURS = ["#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#cc79a7", "#d55e00"];
const CONE_M = 3;
const CONE_DEG = 35;
const NAMES_FROM_PX_PER_M = 12;
const TRAIL_M = 0.25;
const MOST_TRAIL = 4000;

/** Return an element with text in it, which is never read as HTML. @param {string} text */
function plain(text) {
  const element = document.createElement("span");
  element.textContent = text;
  element.dir = "auto";
  return element;
}

export class LiveMap {
  /**
   * @param {HTMLElement} element
   * @param {string} base address of the robot
   * @param {import("./commands.js").Commands} commands
   */
  constructor(element, base, commands) {
    this.base = base;
    this.commands = commands;
    this.origin = { x: 0, y: 0, yaw_deg: 0 };
    this.map = L.map(element, { crs: L.CRS.Simple, minZoom: -3, maxZoom: 8, zoomSnap: 0.25,
      attributionControl: false, zoomDelta: 0.5 });
    this.map.setView([0, 0], 4);
    L.control.scale({ imperial: false }).addTo(this.map);
    this.tiles = new Map();
    this.tilePane = L.layerGroup().addTo(this.map);
    const layer = () => L.layerGroup().addTo(this.map);
    this.layers = { rooms: layer(), closed: layer(), doors: layer(), frontiers: layer(),
      things: layer(), places: layer(), trail: layer(), path: layer(), robot: layer() };
    const { robot: _, ...chosen } = this.layers;
    L.control.layers(null, chosen).addTo(this.map);
    this.isPlaced = false;
    /** @type {number[][]} */
    this.track = [];
    this.trail = L.polyline([], { color: "#888", weight: 2 }).addTo(this.layers.trail);
    this.path = L.polyline([], { color: "#0072b2", weight: 3, dashArray: "6 6" }).addTo(this.layers.path);
    this.cone = L.polygon([], { color: "#d55e00", weight: 1, fillOpacity: 0.12 }).addTo(this.layers.robot);
    this.marker = this.makeRobot();
    this.map.on("click", (/** @type {any} */ event) => this.ask(event.latlng));
    this.map.on("zoomend", () => this.showNames());
  }

  makeRobot() {
    const holder = document.createElement("div");
    holder.innerHTML = '<svg width="30" height="30" viewBox="-15 -15 30 30" role="img" aria-label="robot">' +
      '<path d="M13 0 L-9 9 L-5 0 L-9 -9 Z" fill="#d55e00" stroke="#fff" stroke-width="1.5"/></svg>';
    const icon = L.divIcon({ className: "robot", html: holder, iconSize: [30, 30] });
    this.arrow = /** @type {SVGElement} */ (holder.firstChild);
    return L.marker([0, 0], { icon, keyboard: false, interactive: false });
  }

  /** Return where a point of the map frame is drawn: along the axes of the grid.
   * @param {number[]} at */
  place([x, y]) {
    const turn = -this.origin.yaw_deg * Math.PI / 180;
    const [dx, dy] = [x - this.origin.x, y - this.origin.y];
    return [this.origin.y + Math.sin(turn) * dx + Math.cos(turn) * dy,
      this.origin.x + Math.cos(turn) * dx - Math.sin(turn) * dy];
  }

  /** Return the point of the map frame that is drawn there. @param {{lat: number, lng: number}} at */
  read({ lat, lng }) {
    const turn = this.origin.yaw_deg * Math.PI / 180;
    const [dx, dy] = [lng - this.origin.x, lat - this.origin.y];
    return { x: this.origin.x + Math.cos(turn) * dx - Math.sin(turn) * dy,
      y: this.origin.y + Math.sin(turn) * dx + Math.cos(turn) * dy };
  }

  /** @param {any} grid */
  showMap(grid) {
    this.origin = grid.origin;
    const side_m = grid.tile_cells * grid.resolution_m;
    const [width_m, height_m] = [grid.n_cols * grid.resolution_m, grid.n_rows * grid.resolution_m];
    const fresh = new Map();
    grid.tiles.forEach((/** @type {string[]} */ names, /** @type {number} */ row) =>
      names.forEach((name, col) => {
        if (!name) return;
        const west = grid.origin.x + col * side_m;
        const south = grid.origin.y + row * side_m;
        const east = Math.min(west + side_m, grid.origin.x + width_m);
        const north = Math.min(south + side_m, grid.origin.y + height_m);
        const key = `${row} ${col} ${name} ${west} ${south}`;
        const address = `${this.base}/tiles/${row}/${col}/${name}.png`;
        fresh.set(key, this.tiles.get(key) ?? L.imageOverlay(address, [[south, west], [north, east]],
          { alt: "" }).addTo(this.tilePane));
      }));
    for (const [key, tile] of this.tiles) {
      // A tile goes when what takes its place has come: nothing flickers.
      if (!fresh.has(key)) setTimeout(() => tile.remove(), 300);
    }
    this.tiles = fresh;
    if (!this.isPlaced && fresh.size) {
      this.isPlaced = true;
      this.map.fitBounds(L.featureGroup([...fresh.values()]).getBounds());
    }
  }

  /** @param {any} overlay */
  showOverlay(overlay) {
    const { rooms, doors, frontiers, closed, places, things } = this.layers;
    for (const layer of [rooms, doors, frontiers, closed, places, things]) layer.clearLayers();
    overlay.regions.forEach((/** @type {any} */ region) => {
      const colour = COLOURS[Number(region.id.slice(1)) % COLOURS.length];
      const outlines = region.outlines.map((/** @type {number[][]} */ each) => [each.map((at) => this.place(at))]);
      L.polygon(outlines, { color: colour, weight: 1, fillOpacity: 0.22,
        dashArray: region.kind === "corridor" ? "6 4" : undefined })
        .bindTooltip(plain(`${region.id}: ${region.kind.replace("_", " ")}, ${region.floor_m2} m²`), { sticky: true })
        .addTo(rooms);
      this.name(region.id, region.middle, rooms);
    });
    overlay.doors.forEach((/** @type {any} */ door) =>
      L.circleMarker(this.place(door.at), { radius: 4, color: "#e69f00", fillOpacity: 0.9 })
        .bindTooltip(plain(`${door.id}: ${door.joins.join(", ")}; ${door.width_m} m wide`)).addTo(doors));
    overlay.frontiers.forEach((/** @type {any} */ frontier) => {
      frontier.border.forEach((/** @type {number[]} */ at) =>
        L.circleMarker(this.place(at), { radius: 1.5, stroke: false, fillColor: "#d55e00", fillOpacity: 0.8,
          interactive: false }).addTo(frontiers));
      L.circleMarker(this.place(frontier.at), { radius: 5, color: "#d55e00" })
        .bindTooltip(plain(`${frontier.id}: about ${frontier.promised_m2} m² to see`)).addTo(frontiers);
    });
    overlay.closed.forEach((/** @type {any} */ area) =>
      L.polygon(area.outlines.map((/** @type {number[][]} */ each) => each.map((at) => this.place(at))),
        { color: "#c62828", fillOpacity: 0.25 }).bindTooltip(plain(area.title), { sticky: true }).addTo(closed));
    overlay.places.forEach((/** @type {any} */ place) =>
      L.circleMarker(this.place(place.at), { radius: 6, color: "#0072b2", fillOpacity: 0.5 })
        .bindTooltip(plain(`${place.id}: ${place.name}`)).addTo(places));
    overlay.things.forEach((/** @type {any} */ thing) => {
      if (thing.radius_m) {
        L.circle(this.place(thing.at), { radius: thing.radius_m, color: "#cc79a7", weight: 1, fillOpacity: 0.1,
          interactive: false }).addTo(things);
      }
      L.circleMarker(this.place(thing.at), { radius: 4, color: "#cc79a7", fillOpacity: 0.9 })
        .bindTooltip(plain(`${thing.id}: ${thing.name}, within ${thing.radius_m} m`)).addTo(things);
    });
    this.showNames();
  }

  /** @param {string} text @param {number[]} at @param {any} layer */
  name(text, at, layer) {
    L.tooltip({ permanent: true, direction: "center", className: "name", interactive: false })
      .setLatLng(this.place(at)).setContent(plain(text)).addTo(layer);
  }

  showNames() {
    const isNear = 2 ** this.map.getZoom() >= NAMES_FROM_PX_PER_M;
    this.map.getPane("tooltipPane").style.display = isNear ? "" : "none";
  }

  /** @param {number[][]} trail */
  showTrail(trail) {
    this.track = trail.map((at) => this.place(at));
    this.trail.setLatLngs(this.track);
  }

  /** Lengthen the trail as the server does, for a page that is left open. @param {number[]} at */
  follow(at) {
    const last = this.track.at(-1);
    if (last && Math.abs(at[0] - last[0]) + Math.abs(at[1] - last[1]) < TRAIL_M) return;
    this.track = [...this.track, at].slice(-MOST_TRAIL);
    this.trail.setLatLngs(this.track);
  }

  /** @param {any} robot */
  showRobot(robot) {
    const { pose, drive } = robot;
    this.path.setLatLngs((drive?.path ?? []).map((/** @type {number[]} */ at) => this.place(at)));
    if (!pose) return;
    const at = this.place([pose.x, pose.y]);
    this.marker.setLatLng(at).addTo(this.layers.robot);
    const yaw_deg = pose.yaw_deg - this.origin.yaw_deg;
    if (this.arrow) this.arrow.style.transform = `rotate(${-yaw_deg}deg)`;
    const rim = [-CONE_DEG, -CONE_DEG / 2, 0, CONE_DEG / 2, CONE_DEG].map((off) => {
      const turn = (pose.yaw_deg + off) * Math.PI / 180;
      return this.place([pose.x + CONE_M * Math.cos(turn), pose.y + CONE_M * Math.sin(turn)]);
    });
    this.cone.setLatLngs([at, ...rim]);
    this.follow(at);
  }

  /** Ask what a person wants at a place. @param {{lat: number, lng: number}} latlng */
  ask(latlng) {
    const at = this.read(latlng);
    const target = { x: Number(at.x.toFixed(2)), y: Number(at.y.toFixed(2)) };
    const asked = document.createElement("div");
    asked.className = "at";
    const buttons = [this.commands.button("Check this goal", "check", target),
      this.commands.button("Drive here", "drive", target)];
    asked.append(plain(`x ${target.x}, y ${target.y}`), ...buttons);
    for (const button of buttons) button.addEventListener("click", () => this.map.closePopup());
    L.popup().setLatLng(latlng).setContent(asked).openOn(this.map);
  }
}
