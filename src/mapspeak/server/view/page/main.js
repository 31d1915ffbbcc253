// The page: hears what happens to one robot, and lets a person command it.
// @ts-check
import { Calls } from "./calls.js";
import { Commands } from "./commands.js";
import { LiveMap } from "./map.js";

const OLD_S = 3;
const find = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

const robots = await (await fetch("robots")).json();
const wanted = new URLSearchParams(location.search).get("robot");
const robot = robots.includes(wanted) ? wanted : robots[0];
const base = `robots/${encodeURIComponent(robot)}`;

const commands = new Commands(base);
const map = new LiveMap(find("map"), base, commands);
const calls = new Calls(find("calls"), find("n-calls"), base);

for (const name of robots) {
  const option = new Option(name, name, name === robot, name === robot);
  find("robots").append(option);
}
document.querySelector(".choice")?.classList.toggle("single", robots.length < 2);
find("robots").addEventListener("change", () => {
  location.search = new URLSearchParams({ robot: find("robots").value }).toString();
});

/** @type {any} */
let latest = null;
let heardAt = 0;
let isConnected = false;

const events = new EventSource(`${base}/events`);
const on = (/** @type {string} */ kind, /** @type {(data: any) => void} */ act) =>
  events.addEventListener(kind, (event) => {
    heardAt = performance.now();
    act(JSON.parse(/** @type {MessageEvent} */ (event).data));
  });
events.onopen = () => { isConnected = true; showState(); };
events.onerror = () => { isConnected = false; showState(); };
on("map", (data) => map.showMap(data));
on("overlay", (data) => map.showOverlay(data));
on("trail", (data) => map.showTrail(data));
on("calls", (data) => calls.showAll(data));
on("call", (data) => calls.show(data));
on("alive", () => {});
on("robot", (data) => {
  latest = data;
  map.showRobot(data);
  commands.showWaiting(data.waiting);
  showState();
});

function showState() {
  const silent_s = (performance.now() - heardAt) / 1000;
  const said = [];
  const isLost = !isConnected || silent_s > OLD_S;
  if (isLost) said.push("The server does not answer; trying again.");
  if (latest) {
    const { pose, drive } = latest;
    if (latest.held_by) said.push(`HELD ${latest.held_by}.`);
    if (latest.fault) said.push(latest.fault);
    if (pose) said.push(`x ${pose.x.toFixed(2)}, y ${pose.y.toFixed(2)}, ${pose.yaw_deg.toFixed(0)}°.`);
    if (latest.doubt) said.push(latest.doubt);
    if (drive) said.push(`${drive.id} to ${drive.place}: ${drive.state}. ${drive.reason}`);
    const age_s = latest.age_s + silent_s;
    if (age_s > OLD_S) said.push(`The pose is ${age_s.toFixed(0)} s old.`);
    find("state").classList.toggle("old", isLost || age_s > OLD_S || Boolean(latest.doubt));
  }
  find("state").textContent = said.join(" ") || "Waiting for the robot.";
}
setInterval(showState, 1000);

const camera = find("camera");
camera.addEventListener("error", () => { camera.alt = "No picture from the robot's camera."; });
function lookAhead() {
  if (find("watching").checked && document.visibilityState === "visible" && isConnected) {
    camera.src = `${base}/camera?at=${Date.now()}`;
  }
}
setInterval(lookAhead, 1000);
