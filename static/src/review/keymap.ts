/**
 * Which key does what. Keys go by their place on the keyboard (event.code), so that the hand finds
 * them under any layout; keys with Ctrl, Alt or Meta belong to the browser, and keys typed into a
 * field to that field. A person may put a command on other keys; a key that is taken is refused.
 */
import type { Command, Mode } from "./modes";

export interface KeyPress {
  readonly code: string;
  readonly key: string;
  readonly ctrlKey: boolean;
  readonly altKey: boolean;
  readonly metaKey: boolean;
  readonly shiftKey: boolean;
}

/** A person's own keys: command id to places on the keyboard. */
export type Bindings = Readonly<Record<string, readonly string[]>>;

/** Places that belong to the browser, to the view or to every mode alike. */
const RESERVED = /^(Tab|Escape|F\d+|Arrow.*|(Control|Alt|Meta|Shift|OS).*|CapsLock|Equal|Minus|Digit0|Numpad(Add|Subtract|0)|ContextMenu|Unidentified|)$/;

export class Keymap {
  private readonly listeners: (() => void)[] = [];

  constructor(private own: Bindings = {}) {}

  get bindings(): Bindings {
    return this.own;
  }

  set(bindings: Bindings): void {
    this.own = bindings;
    for (const listener of this.listeners) {
      listener();
    }
  }

  onChange(listener: () => void): void {
    this.listeners.push(listener);
  }

  codesOf({ id, codes }: Command): readonly string[] {
    return this.own[id] ?? codes;
  }

  /** The command of a key press in a mode; null leaves the key to the browser. */
  commandOf(commands: readonly Command[], press: KeyPress): Command | null {
    if (press.ctrlKey || press.altKey || press.metaKey) {
      return null;
    }
    const fits = ({ shift = "without" }: Command): boolean =>
      shift === "fine" || (shift === "with") === press.shiftKey;
    const found = commands.find(
      (command) => this.codesOf(command).includes(press.code) && fits(command),
    );
    return found ?? null;
  }

  /** Why a command cannot stand on a key: who has it already, or whose it is. Null: it can. */
  conflict(modes: readonly Mode[], wanted: Command, code: string): string | null {
    const mode = modes.find(({ commands }) => commands.includes(wanted));
    if (RESERVED.test(code) && !wanted.codes.includes(code)) {
      return `${keyName(code)} has its own meaning on every page.`;
    }
    // Reasons and review share the keyboard: a reason's key would never reach the other.
    const shared = ["review", "reasons"];
    const rivals = modes.filter(
      ({ name }) => name === mode?.name || (shared.includes(name) && shared.includes(mode?.name ?? "")),
    );
    const taker = rivals
      .flatMap(({ commands }) => commands)
      .find(
        (command) =>
          command !== wanted && overlaps(command, wanted) && this.codesOf(command).includes(code),
      );
    return taker === undefined ? null : `${keyName(code)} is the key of “${taker.meaning}”.`;
  }
}

function overlaps(a: Command, b: Command): boolean {
  const [one = "without", other = "without"] = [a.shift, b.shift];
  return one === other || one === "fine" || other === "fine";
}

const NAMES: ReadonlyMap<string, string> = new Map([
  ["Space", "Space"],
  ["Backspace", "Backspace"],
  ["Enter", "Enter"],
  ["Escape", "Esc"],
  ["ArrowLeft", "←"],
  ["ArrowRight", "→"],
  ["ArrowUp", "↑"],
  ["ArrowDown", "↓"],
  ["Comma", ","],
  ["Period", "."],
  ["Slash", "/"],
  ["Semicolon", ";"],
  ["Quote", "'"],
  ["BracketLeft", "["],
  ["BracketRight", "]"],
  ["Backslash", "\\"],
  ["Backquote", "`"],
]);

/** What is printed on a key of a US keyboard. */
export function keyName(code: string): string {
  return NAMES.get(code) ?? code.replace(/^(Key|Digit)/, "").replace(/^Numpad/, "Num ");
}

/** The keys of a command as the help shows them; the keypad's twins are left out. */
export function keyNames(keymap: Keymap, command: Command): readonly string[] {
  const codes = keymap.codesOf(command);
  const shown = codes.filter((code, i) => i === 0 || !code.startsWith("Numpad"));
  return shown.map((code) => (command.shift === "with" ? `⇧ ${keyName(code)}` : keyName(code)));
}

/** What `isTyping` asks of the element that has the focus. */
interface Focused {
  readonly tagName: string;
  readonly isContentEditable: boolean;
  readonly type?: string;
  checkVisibility(): boolean;
}

/**
 * Whether a key press is meant for the element that has the focus. The field of a dialog that was
 * just closed keeps the focus until the next frame: a quick hand's key is not meant for it.
 */
export function isTyping(target: Focused): boolean {
  const typed = ["INPUT", "TEXTAREA", "SELECT"].includes(target.tagName);
  const isTick = target.tagName === "INPUT" && ["checkbox", "radio"].includes(target.type ?? "");
  return (target.isContentEditable || (typed && !isTick)) && target.checkVisibility();
}
