/** Short messages, which the toast of the studio shows. */

const NAME = "safenav-notice";

export function notice(words: string): void {
  dispatchEvent(new CustomEvent(NAME, { detail: words }));
}

export function onNotice(show: (words: string) => void): () => void {
  const heard = (event: Event): void => show((event as CustomEvent<string>).detail);
  addEventListener(NAME, heard);
  return () => removeEventListener(NAME, heard);
}

/** Return the properties of a button that, while `off`, only shows this advice. */
export function unless(off: string | false | null | undefined, act: () => void, title?: string) {
  return off
    ? { "aria-disabled": true as const, title: off, onClick: () => notice(off) }
    : { title, onClick: act };
}
