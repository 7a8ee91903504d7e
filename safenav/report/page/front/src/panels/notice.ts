/** Short messages of the page, shown by whatever listens: the toast of the studio. */

const NAME = "safenav-notice";

export function notice(words: string): void {
  dispatchEvent(new CustomEvent(NAME, { detail: words }));
}

export function onNotice(show: (words: string) => void): () => void {
  const heard = (event: Event): void => show((event as CustomEvent<string>).detail);
  addEventListener(NAME, heard);
  return () => removeEventListener(NAME, heard);
}

/** The properties of a button that does nothing now and says what to do instead (`off`). */
export function unless(off: string | false | null | undefined, act: () => void, title?: string) {
  return off
    ? { "aria-disabled": true as const, title: off, onClick: () => notice(off) }
    : { title, onClick: act };
}
