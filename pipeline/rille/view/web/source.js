// What the page shows: a replay's blobs inside the page, or a live server's layout and scene.
export const sourceOfPage = () => JSON.parse(document.getElementById("rille-source").textContent);

export async function bytesOf(blob, encoding) { // base64 text, or {base64, encoding}
  const text = typeof blob === "string" ? blob : blob.base64;
  const how = (typeof blob === "string" ? undefined : blob.encoding) ?? encoding ?? "";
  const binary = atob(text), bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  if (!how || how === "none") return bytes.buffer;
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream(how));
  return new Response(stream).arrayBuffer();
}

export async function replayOf(source) {
  const all = source.encoding, layout = source.layout;
  const scene = await bytesOf(source.scene, all);
  const runs = await Promise.all((source.runs ?? []).map(async run => {
    const how = run.encoding ?? all;
    const [time, states] = await Promise.all([bytesOf(run.time, how), bytesOf(run.states, how)]);
    const extra = await Promise.all((run.extra ?? []).map(async channel => ({
      label: channel.label, unit: channel.unit ?? "",
      time: new Float64Array(await bytesOf(channel.time, channel.encoding ?? how)),
      values: new Float64Array(await bytesOf(channel.values, channel.encoding ?? how)),
    })));
    return { label: run.label, time: new Float64Array(time), states: new Float32Array(states), events: run.events ?? [], extra };
  }));
  return { layout, scene, runs, mode: source.mode ?? (runs.length > 1 ? "ghost" : "single") };
}

export const tokenOfPage = () => new URLSearchParams(location.hash.slice(1)).get("token");

export async function asked(path, kind = "json") { // GET, with the token where there is one
  const token = tokenOfPage(), headers = token ? { Authorization: `Bearer ${token}` } : {};
  const answer = await fetch(path, { headers, cache: "no-store" });
  if (!answer.ok) {
    let sentence = "";
    try { const body = await answer.json(); sentence = body.sentence ?? body.detail ?? body.message ?? ""; } catch { /* no JSON: the status must do */ }
    throw new Error(typeof sentence === "string" && sentence ? sentence : `${path}: ${answer.status} ${answer.statusText}`);
  }
  return kind === "json" ? answer.json() : answer.arrayBuffer();
}
