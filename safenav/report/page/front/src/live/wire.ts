/** Web socket to the studio, which reconnects after a loss. */

export type Message = { is: string } & Record<string, any>;

export class Wire {
  connected = false;
  private socket: WebSocket | null = null;
  private waiting: string[] = [];
  private delay = 250;

  constructor(
    private readonly heard: (message: Message) => void,
    private readonly changed: (connected: boolean) => void,
  ) {
    this.connect();
  }

  /** Send a message to the studio; without a connection, after the next one. */
  say = (does: string, data: object = {}): void => {
    const text = JSON.stringify({ do: does, ...data });
    if (this.connected) this.socket!.send(text);
    else if (this.waiting.length < 100) this.waiting.push(text);
  };

  private connect(): void {
    const address = new URL("socket", location.href.replace(/#.*$/, ""));
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = (this.socket = new WebSocket(address));
    socket.onopen = () => {
      this.connected = true;
      this.delay = 250;
      for (const text of this.waiting.splice(0)) socket.send(text);
      this.changed(true);
    };
    socket.onmessage = (event) => this.heard(JSON.parse(event.data as string) as Message);
    socket.onclose = () => {
      this.connected = false;
      this.changed(false);
      setTimeout(() => this.connect(), this.delay);
      this.delay = Math.min(5000, this.delay * 2);
    };
  }
}
