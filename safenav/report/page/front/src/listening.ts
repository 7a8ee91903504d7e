/** Listeners that end together. */

/** Listen to events of an element or the window; the result stops that. */
export function heard<E extends Event>(
  target: EventTarget,
  listeners: Record<string, (event: E) => void>,
  options: AddEventListenerOptions = {},
): () => void {
  const end = new AbortController();
  for (const [name, listener] of Object.entries(listeners)) {
    target.addEventListener(name, listener as (event: Event) => void, { ...options, signal: end.signal });
  }
  return () => end.abort();
}

/** Call back with each new size of an element; the result stops that. */
export function resized(element: Element, listener: () => void): () => void {
  const observer = new ResizeObserver(listener);
  observer.observe(element);
  return () => observer.disconnect();
}
