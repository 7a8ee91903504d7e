/** A scenario in the fragment of an address, compressed: `#scenario=...`. */

const KEY = "scenario=";

export async function packed(text: string): Promise<string> {
  const stream = new Blob([text]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let binary = "";
  for (const byte of bytes) binary += String.fromCharCode(byte);
  return btoa(binary).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

/** Return a link to a scenario; its fragment opens in any studio. */
export async function linkOf(text: string): Promise<string> {
  return `#${KEY}${await packed(text)}`;
}

/** Return the scenario in a fragment; null if there is none. */
export function packedIn(fragment: string): string | null {
  const found = fragment.replace(/^[^#]*#/, "");
  return found.startsWith(KEY) ? found.slice(KEY.length) : null;
}
