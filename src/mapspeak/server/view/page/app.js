// The map in a chat (MCP Apps): shows what the robot knows now, and puts words to the model.
// @ts-check
"use strict";

const PROTOCOL = "2026-01-26";
const LOOK = "view_map";
const LOOK_S = 2;
const HEIGHT_PX = 460;

/** Speaks to the host of this frame: JSON-RPC by messages to its window. */
class Host {
  constructor() {
    /** @type {Map<number, {resolve: (result: any) => void, reject: (error: Error) => void}>} */
    this.waiting = new Map();
    /** @type {Record<string, (params: any) => any>} */
    this.heard = { ping: () => ({}), "ui/resource-teardown": () => ({}) };
    this.number = 0;
    window.addEventListener("message", (event) => {
      if (event.source === window.parent && event.data?.jsonrpc === "2.0") this.hear(event.data);
    });
  }

  /** @param {any} message */
  hear({ id, method, params, result, error }) {
    if (method) {
      const answer = this.heard[method]?.(params);
      if (id !== undefined) this.post(answer ? { id, result: answer } : { id, error: { code: -32601, message: method } });
      return;
    }
    const asked = this.waiting.get(id);
    this.waiting.delete(id);
    if (error) asked?.reject(new Error(error.message)); else asked?.resolve(result);
  }

  /** @param {object} message */
  post(message) {
    window.parent.postMessage({ jsonrpc: "2.0", ...message }, "*");
  }

  /** @param {string} method @param {object} params @returns {Promise<any>} */
  ask(method, params) {
    const id = ++this.number;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.post({ id, method, params });
    });
  }
}

class ChatMap {
  /** @param {Host} host */
  constructor(host) {
    this.host = host;
    /** @type {Record<string, string>} */
    this.pictures = {};
    /** @type {Record<string, unknown>} */
    this.chosen = {};
    this.isLooking = false;
    this.map = new MapView(byId("map"), { onClick: (click) => this.offer(click), index: byId("items") });
    host.heard["ui/notifications/tool-input"] = ({ arguments: given }) => {
      this.chosen = given?.robot ? { robot: given.robot } : {};
    };
    host.heard["ui/notifications/tool-result"] = (result) => { this.showAnswer(result); this.look(); };
    host.heard["ui/notifications/host-context-changed"] = (context) => this.fit(context);
  }

  async begin() {
    const told = await this.host.ask("ui/initialize", {
      protocolVersion: PROTOCOL,
      appInfo: { name: "mapspeak", version: "1" },
      appCapabilities: { availableDisplayModes: ["inline", "fullscreen"] },
    });
    this.canLook = Boolean(told.hostCapabilities?.serverTools);
    this.fit(told.hostContext ?? {});
    this.host.post({ method: "ui/notifications/initialized", params: {} });
    this.host.post({ method: "ui/notifications/size-changed", params: { height: HEIGHT_PX } });
    if (this.canLook) setInterval(() => { if (document.visibilityState === "visible") this.look(); }, 1000 * LOOK_S);
  }

  /** @param {{theme?: string}} context */
  fit({ theme }) {
    if (theme) document.documentElement.style.colorScheme = theme;
  }

  /** Show the tool's own picture, where the host lets nothing be asked of the server. @param {any} result */
  showAnswer(result) {
    const picture = result?.content?.find((/** @type {any} */ part) => part.type === "image");
    document.body.classList.toggle("still", !this.canLook);
    if (!picture || this.canLook) return;
    byId("picture").replaceChildren(showPicture(`data:${picture.mimeType};base64,${picture.data}`, "The map as it was looked at"));
  }

  /** Fetch what has changed, and draw it. */
  async look() {
    if (!this.canLook || this.isLooking) return;
    this.isLooking = true;
    try {
      const known = Object.keys(this.pictures);
      const { structuredContent: told, isError } = await this.host.ask("tools/call",
        { name: LOOK, arguments: { ...this.chosen, known } });
      if (isError || !told) throw new Error("no answer");
      this.draw(told);
    } catch {
      byId("state").textContent = "The robot's server does not answer; trying again.";
    } finally {
      this.isLooking = false;
    }
  }

  /** @param {any} told */
  draw({ map, overlay, robot }) {
    if (map) {
      Object.assign(this.pictures, map.pictures);
      this.map.showMap({ ...map, pictures: this.pictures });
      const shown = new Set(map.tiles.flat());
      for (const name of Object.keys(this.pictures)) if (!shown.has(name)) delete this.pictures[name];
    }
    const lies = JSON.stringify(overlay);
    if (lies !== this.lies) this.map.showOverlay(overlay);
    this.lies = lies;
    this.map.follow(robot);
    const { pose, drive, held_by: held, fault, doubt } = robot;
    const said = [held && `HELD ${held}.`, fault, pose && `Robot at x ${pose.x.toFixed(1)}, y ${pose.y.toFixed(1)}.`,
      doubt, drive && `${drive.id} to ${drive.place}: ${drive.state}.`];
    byId("state").textContent = legible(said.filter(Boolean).join(" "));
  }

  /** @param {Click} click */
  offer({ x, y, at, item }) {
    const isPlace = item?.id && item.kind !== "closed";
    const where = isPlace ? item.id : `x ${x}, y ${y}`;
    const [offered, button] = [document.createElement("div"), document.createElement("button")];
    button.textContent = `Go to ${where}`;
    button.addEventListener("click", () => { this.map.closeBubble(); this.say(`Go to ${where}.`); });
    offered.append(plain(isPlace ? item.said : where), button);
    this.map.ask(at, offered);
  }

  /** Put words to the model, as if the person had typed them. @param {string} text */
  async say(text) {
    let isTaken = false;
    try {
      const answer = await this.host.ask("ui/message", { role: "user", content: [{ type: "text", text }] });
      isTaken = !answer?.isError;
    } catch { /* told below */ }
    byId("said").hidden = false;
    byId("said").textContent = isTaken ? `Told the model: ${text}` : `The chat did not take it; type: ${text}`;
  }
}

new ChatMap(new Host()).begin();
