// The map: tiles of the grid, and what lies on it. It is the same in the live page, in a chat and
// in a replay; these differ in where tiles come from and in what a click does.
// @ts-check
"use strict";
/* global L */

/**
 * What was clicked: a point of the map, and what lies there.
 * @typedef {{x: number, y: number, at: {lat: number, lng: number}, item: Item | null}} Click
 * @typedef {{kind: string, id: string, name?: string, said?: string}} Item
 */

const COLOURS = ["#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#cc79a7", "#d55e00"];
const CONE_M = 3;
const NAMES_FROM_PX_PER_M = 12;
/** From here on doors, frontiers, places and things have their names beside them. */
const ALL_NAMES_FROM_PX_PER_M = 45;
const MARKS = { rooms: "▰", closed: "▰", doors: "●", frontiers: "○", things: "●", places: "●", trail: "—", path: "┅" };
/** What the robot's navigation tells of itself; view.css has the colours, those of look_at_map. */
const NAVIGATION = ["plan", "footprint", "global_costmap", "local_costmap"];
/** Places no farther apart share their name on the map. */
const STACK_M = 0.5;
const TRAIL_M = 0.25;
const MOST_TRAIL = 4000;

/** Return an element of the page. @param {string} id */
function byId(id) {
  return /** @type {any} */ (document.getElementById(id));
}

// Control characters, and those that turn the direction of what follows.
const INVISIBLE = /[\u0000-\u0008\u000b\u000c\u000e-\u001f\u007f-\u009f\u061c\u200b-\u200f\u202a-\u202e\u2060-\u2069\ufeff\ufff0-\uffff]/g;

/** Spell out what nobody can see in a text. @param {string} text */
function legible(text) {
  return text.replace(INVISIBLE, (found) =>
    `<U+${found.charCodeAt(0).toString(16).toUpperCase().padStart(4, "0")}>`);
}

/** Say how long ago something was. @param {number} age_s */
function ago(age_s) {
  if (age_s < 90) return `${Math.max(0, age_s).toFixed(0)} s ago`;
  return age_s < 5400 ? `${(age_s / 60).toFixed(0)} min ago` : `${(age_s / 3600).toFixed(0)} h ago`;
}

/** Return an element with text in it, which is never read as HTML. @param {string} text */
function plain(text) {
  const element = document.createElement("span");
  element.textContent = legible(text);
  element.dir = "auto";
  return element;
}

class MapView {
  /**
   * @param {HTMLElement} element
   * @param {{tile?: (row: number, col: number, name: string) => string,
   *   onClick?: (click: Click) => void, index?: HTMLElement | null}} options tile tells where a
   *   tile comes from that the map does not hold itself; index lists all that can be clicked
   */
  constructor(element, { tile = () => "", onClick = () => {}, index = null } = {}) {
    this.index = index;
    /** @type {{said: string, item: Item, at: number[]}[]} */
    this.listed = [];
    this.tile = tile;
    this.onClick = onClick;
    this.origin = { x: 0, y: 0, yaw_deg: 0 };
    this.map = L.map(element, { crs: L.CRS.Simple, minZoom: -3, maxZoom: 8, zoomSnap: 0.25,
      attributionControl: false, zoomDelta: 0.5 });
    this.map.setView([0, 0], 4);
    L.control.scale({ imperial: false }).addTo(this.map);
    this.tiles = new Map();
    this.tilePane = L.layerGroup().addTo(this.map);
    // Over the robot's arrow, which is larger than its footprint until a person zooms in.
    this.map.createPane("over").style.zIndex = "620";
    const layer = () => L.layerGroup().addTo(this.map);
    this.layers = { rooms: layer(), closed: layer(), doors: layer(), frontiers: layer(),
      things: layer(), places: layer(), trail: layer(), path: layer(), robot: layer(), navigation: L.layerGroup() };
    const named = Object.entries(MARKS).map(([name, mark]) =>
      [`<span class="mark ${name}">${mark}</span> ${name}`, this.layers[/** @type {keyof typeof MARKS} */ (name)]]);
    this.switches = L.control.layers(null, Object.fromEntries(named)).addTo(this.map);
    this.addWholeButton();
    // The view grows with the map until a person moves it.
    this.isFollowing = true;
    this.isFitting = false;
    this.map.on("movestart zoomstart", () => { this.isFollowing &&= this.isFitting; });
    /** @type {number[][]} */
    this.track = [];
    this.trail = L.polyline([], { color: "#888", weight: 2 }).addTo(this.layers.trail);
    this.path = L.polyline([], { color: "#0072b2", weight: 3, dashArray: "6 6" }).addTo(this.layers.path);
    this.goal = L.circleMarker([0, 0], { radius: 9, color: "#0072b2", weight: 3, fill: false, interactive: false });
    this.cone = L.polygon([], { color: "#d55e00", weight: 1, fillOpacity: 0.12 }).addTo(this.layers.robot);
    this.marker = this.makeRobot();
    this.map.on("resize", () => { if (this.isFollowing) this.showWhole(); });
    this.map.on("click", (/** @type {any} */ event) => this.click(event.latlng, null));
    this.map.on("zoomend", () => this.showNames());
  }

  addWholeButton() {
    const button = document.createElement("button");
    button.title = "Show the whole map, and follow it as it grows";
    button.setAttribute("aria-label", button.title);
    button.className = "leaflet-bar whole";
    button.textContent = "\u2922";
    L.DomEvent.disableClickPropagation(button);
    button.addEventListener("click", () => { this.isFollowing = true; this.showWhole(); });
    const control = new L.Control({ position: "topleft" });
    control.onAdd = () => button;
    control.addTo(this.map);
  }

  /** Fit the view to the tiles. */
  showWhole() {
    if (!this.tiles.size) return;
    this.isFitting = true;
    this.map.fitBounds(L.featureGroup([...this.tiles.values()]).getBounds(), { animate: false });
    this.isFitting = false;
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
        const address = grid.pictures?.[name] ?? this.tile(row, col, name);
        fresh.set(key, this.tiles.get(key) ?? L.imageOverlay(address, [[south, west], [north, east]],
          { alt: "" }).addTo(this.tilePane));
      }));
    for (const [key, tile] of this.tiles) {
      // A tile goes when what takes its place has come: nothing flickers.
      if (!fresh.has(key)) setTimeout(() => tile.remove(), 300);
    }
    const isOther = [...fresh.keys()].some((key) => !this.tiles.has(key));
    this.tiles = fresh;
    if (isOther && this.isFollowing) this.showWhole();
  }

  /** @param {any} overlay */
  showOverlay(overlay) {
    const { rooms, doors, frontiers, closed, places, things } = this.layers;
    for (const layer of [rooms, doors, frontiers, closed, places, things]) layer.clearLayers();
    this.listed = [];
    overlay.regions.forEach((/** @type {any} */ region) => {
      const colour = COLOURS[Number(region.id.slice(1)) % COLOURS.length];
      const outlines = region.outlines.map((/** @type {number[][]} */ each) => [each.map((at) => this.place(at))]);
      const shape = L.polygon(outlines, { color: colour, weight: 1, fillOpacity: 0.22,
        dashArray: region.kind === "corridor" ? "6 4" : undefined });
      this.put(shape, rooms, `${region.kind.replace("_", " ")}, ${region.floor_m2} m²`,
        { kind: "room", id: region.id }, region.middle);
      this.name(region.id, region.middle, rooms, "name");
    });
    overlay.doors.forEach((/** @type {any} */ door) =>
      this.put(L.circleMarker(this.place(door.at), { radius: 4, color: "#e69f00", fillOpacity: 0.9 }), doors,
        `door of ${door.joins.join(" and ")}, ${door.width_m} m wide`, { kind: "door", id: door.id }, door.at));
    overlay.frontiers.forEach((/** @type {any} */ frontier) => {
      frontier.border.forEach((/** @type {number[]} */ at) =>
        L.circleMarker(this.place(at), { radius: 1.5, stroke: false, fillColor: "#d55e00", fillOpacity: 0.8,
          interactive: false }).addTo(frontiers));
      this.put(L.circleMarker(this.place(frontier.at), { radius: 5, color: "#d55e00" }), frontiers,
        `frontier, about ${frontier.promised_m2} m² to see`, { kind: "frontier", id: frontier.id }, frontier.at);
    });
    overlay.closed.forEach((/** @type {any} */ area) =>
      this.put(L.polygon(area.outlines.map((/** @type {number[][]} */ each) => each.map((at) => this.place(at))),
        { color: "#c62828", fillOpacity: 0.25 }), closed, area.title, { kind: "closed", id: area.event_id }, area.outlines[0][0]));
    overlay.places.forEach((/** @type {any} */ place) =>
      this.put(L.circleMarker(this.place(place.at), { radius: 6, color: "#0072b2", fillOpacity: 0.5 }), places,
        place.name, { kind: "place", id: place.id, name: place.name }, place.at));
    overlay.things.forEach((/** @type {any} */ thing) => {
      if (thing.radius_m) {
        L.circle(this.place(thing.at), { radius: thing.radius_m, color: "#cc79a7", weight: 1, fillOpacity: 0.1,
          interactive: false }).addTo(things);
      }
      this.put(L.circleMarker(this.place(thing.at), { radius: 4, color: "#cc79a7", fillOpacity: 0.9 }), things,
        `${thing.name}, within ${thing.radius_m} m`, { kind: "thing", id: thing.id, name: thing.name }, thing.at);
    });
    this.namePlaces(overlay.places, places);
    this.showNames();
    this.index?.replaceChildren(...this.listed.map(({ said, item, at }) => {
      const [row, button] = [document.createElement("li"), document.createElement("button")];
      button.append(plain(said));
      button.addEventListener("click", () => {
        const [lat, lng] = this.place(at);
        this.map.panTo([lat, lng], { animate: false });
        this.click({ lat, lng }, item);
      });
      row.append(button);
      return row;
    }));
  }

  /** Draw something with an id, which can be hovered over and clicked.
   * @param {any} shape @param {any} layer @param {string} told @param {Item} item
   * @param {number[]} at */
  put(shape, layer, told, item, at) {
    const said = item.id && item.kind !== "closed" ? `${item.id}: ${told}` : told;
    item.said = said;
    this.listed.push({ said, item, at });
    shape.bindTooltip(plain(said), { sticky: true }).addTo(layer);
    if (["door", "frontier"].includes(item.kind)) this.name(item.id, at, layer, "name near");
    if (item.kind === "thing") this.name(item.name ?? "", at, layer, "name near");
    shape.on("click", (/** @type {any} */ event) => {
      L.DomEvent.stopPropagation(event);
      this.click(event.latlng, item);
    });
  }

  /** Name places; those that lie on one spot have one name, such as "W46 and 3 more".
   * @param {{id: string, name: string, at: number[]}[]} places @param {any} layer */
  namePlaces(places, layer) {
    /** @type {Map<string, {id: string, name: string, at: number[]}[]>} */
    const spots = new Map();
    for (const place of places) {
      const spot = place.at.map((each) => Math.round(each / STACK_M)).join();
      spots.set(spot, [...spots.get(spot) ?? [], place]);
    }
    for (const stack of spots.values()) {
      const said = stack.length > 1 ? `${stack[0].id} and ${stack.length - 1} more` : stack[0].name;
      this.name(said, stack[0].at, layer, "name near");
    }
  }

  /** @param {string} text @param {number[]} at @param {any} layer @param {string} className */
  name(text, at, layer, className) {
    const isBeside = className !== "name";
    L.tooltip({ permanent: true, direction: isBeside ? "right" : "center", offset: isBeside ? [4, 0] : [0, 0],
      className, interactive: false })
      .setLatLng(this.place(at)).setContent(plain(text)).addTo(layer);
  }

  showNames() {
    const scale = 2 ** this.map.getZoom();
    this.map.getPane("tooltipPane").style.display = scale >= NAMES_FROM_PX_PER_M ? "" : "none";
    this.map.getContainer().classList.toggle("far", scale < ALL_NAMES_FROM_PX_PER_M);
  }

  /** @param {number[][]} trail */
  showTrail(trail) {
    this.track = trail.map((at) => this.place(at));
    this.trail.setLatLngs(this.track);
  }

  /** Lengthen the trail as the server does, for a page that is left open. @param {any} robot */
  follow(robot) {
    const at = this.showRobot(robot);
    const last = this.track.at(-1);
    if (!at || last && Math.abs(at[0] - last[0]) + Math.abs(at[1] - last[1]) < TRAIL_M) return;
    this.track = [...this.track, at].slice(-MOST_TRAIL);
    this.trail.setLatLngs(this.track);
  }

  /** @param {any} robot */
  showRobot({ pose, drive, goal, camera_fov_deg: fov_deg }) {
    const wanted = goal ?? (drive?.path.length ? drive.goal : null);
    if (wanted) this.goal.setLatLng(this.place([wanted.x, wanted.y])).addTo(this.layers.path);
    else this.goal.remove();
    this.path.setLatLngs((drive?.path ?? []).map((/** @type {number[]} */ at) => this.place(at)));
    if (!pose) return null;
    const at = this.place([pose.x, pose.y]);
    this.marker.setLatLng(at).addTo(this.layers.robot);
    const yaw_deg = pose.yaw_deg - this.origin.yaw_deg;
    if (this.arrow) this.arrow.style.transform = `rotate(${-yaw_deg}deg)`;
    const rim = [-1, -0.5, 0, 0.5, 1].map((share) => {
      const turn = (pose.yaw_deg + share * fov_deg / 2) * Math.PI / 180;
      return this.place([pose.x + CONE_M * Math.cos(turn), pose.y + CONE_M * Math.sin(turn)]);
    });
    this.cone.setLatLngs(fov_deg ? [at, ...rim] : []);
    return at;
  }

  /** Let a person switch on what the robot's navigation tells of itself. */
  offerNavigation() {
    const signs = NAVIGATION.map((part) => `<br><span class="sign mark ${part}">▱</span> ${part.replace("_", " ")}`);
    this.switches.addOverlay(this.layers.navigation, `navigation${signs.join("")}`);
  }

  /** Draw what the robot's navigation tells of itself. @param {{part: string, said: string, lines: number[][][]}[]} parts */
  showNavigation(parts) {
    const layer = this.layers.navigation.clearLayers();
    for (const { part, said, lines } of parts) {
      for (const line of lines) {
        L.polyline(line.map((at) => this.place(at)), { className: part, weight: 2, pane: "over" })
          .bindTooltip(plain(said), { sticky: true }).addTo(layer);
      }
    }
  }

  /** True while that layer is switched on. */
  get showsNavigation() {
    return this.map.hasLayer(this.layers.navigation);
  }

  /** Tell of a click. @param {{lat: number, lng: number}} at @param {Item | null} item */
  click(at, item) {
    const { x, y } = this.read(at);
    this.onClick({ x: Number(x.toFixed(2)), y: Number(y.toFixed(2)), at, item });
  }

  /** Open a bubble. @param {{lat: number, lng: number}} at @param {HTMLElement} content */
  ask(at, content) {
    content.classList.add("at");
    const width = Math.min(300, this.map.getSize().x - 130);
    L.popup({ minWidth: 180, maxWidth: width, autoPanPaddingTopLeft: [50, 10], autoPanPaddingBottomRight: [60, 10] }).setLatLng(at).setContent(content).openOn(this.map);
  }

  /** Show a part of the map frame. @param {number[][]} points */
  fit(points) {
    if (points.length) this.map.fitBounds(points.map((at) => this.place(at)), { maxZoom: 5 });
  }

  closeBubble() {
    this.map.closePopup();
  }
}
