/** The studio's messages as a stream of events, which reconnects after a loss; requests as POST, in their order. */

export type Message = { is: string } & Record<string, any>;

export class Wire {
  connected = false;
  private asked: Promise<unknown> = Promise.resolve();

  constructor(
    private readonly heard: (message: Message) => void,
    private readonly changed: (connected: boolean) => void,
  ) {
    const events = new EventSource("events");
    events.onmessage = (event) => heard(JSON.parse(event.data as string) as Message);
    events.onopen = () => this.turn(true);
    events.onerror = () => this.turn(false);
  }

  /** Send a request to the studio, after those before it. */
  say = (does: string, data: object = {}): void => {
    const body = JSON.stringify({ do: does, ...data });
    this.asked = this.asked.then(() => this.ask(body)).catch(() => this.turn(false));
  };

  private async ask(body: string): Promise<void> {
    const answer = await fetch("say", { method: "POST", body });
    const message = answer.ok ? ((await answer.json()) as Message | null) : { is: "refused", message: await answer.text() };
    if (message !== null) this.heard(message);
  }

  private turn(connected: boolean): void {
    this.connected = connected;
    this.changed(connected);
  }
}
