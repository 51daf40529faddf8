/** Pages that fill by themselves: every [data-live] is fetched again, every [data-live-form] asks at once. */
import { LivePage } from "./page/live";

new LivePage(document).start();
