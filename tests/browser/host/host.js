// A chat's side of an MCP App, by the reference implementation of the extension.
import { AppBridge, PostMessageTransport } from "@modelcontextprotocol/ext-apps/app-bridge";

const frame = document.getElementById("app");
const settings = new URLSearchParams(location.search);
const canAsk = !settings.has("mute");
window.said = [];

async function call(params) {
  const answer = await fetch("call", { method: "POST", body: JSON.stringify(params) });
  return answer.json();
}

const capabilities = canAsk ? { serverTools: {}, message: { text: {} } } : {};
const context = { theme: settings.get("theme") ?? "light", displayMode: "inline" };
const bridge = new AppBridge(null, { name: "test host", version: "1" }, capabilities, { hostContext: context });
bridge.oncalltool = call;
bridge.onmessage = async ({ role, content }) => {
  if (!canAsk) return { isError: true };
  window.said.push(`${role}: ${content[0].text}`);
  return {};
};
bridge.onsizechange = ({ height }) => { if (height) frame.style.height = `${height}px`; };
bridge.oninitialized = async () => {
  const look = { name: "look_at_map", arguments: {} };
  await bridge.sendToolInput({ arguments: look.arguments });
  await bridge.sendToolResult(await call(look));
};
await bridge.connect(new PostMessageTransport(frame.contentWindow, frame.contentWindow));
frame.src = "page";
