/** The page of the studio: a run as it happens and, where there is an editor, the drawing of it. */

import { render } from "preact";
import { Studio } from "./studio";
import "../page.css";
import "./studio.css";

render(<Studio />, document.getElementById("app")!);
