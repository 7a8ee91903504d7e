/** A text field that takes effect when the user has finished. */

import { useEffect, useRef, useState } from "preact/hooks";

interface FieldProps {
  name: string;
  value: string;
  number?: boolean;
  /** Whether the reader types here next. */
  focused?: boolean | undefined;
  onChange(value: string): void;
}

/** A field that reports its value when it is left, or with Enter. */
export function Field({ name, value, number, focused, onChange }: FieldProps) {
  const [own, setOwn] = useState(value);
  const input = useRef<HTMLInputElement>(null);
  useEffect(() => setOwn(value), [value]);
  useEffect(() => {
    if (focused) input.current!.select();
  }, []);
  const tell = (): void => {
    if (own !== value) onChange(own);
  };
  return (
    <label>
      {name}
      <input
        ref={input}
        inputMode={number ? "numeric" : "text"}
        aria-label={name}
        value={own}
        onInput={(event) => setOwn(event.currentTarget.value)}
        onBlur={tell}
        onKeyDown={(event) => event.key === "Enter" && event.currentTarget.blur()}
      />
    </label>
  );
}
