/** What every page needs: the stylesheet, the theme toggle, menus, dialogs and messages. */
import "./styles/main.css";
import { enableCopying } from "./page/copying";
import { enableDialogs } from "./page/dialogs";
import { enableFlashes } from "./page/flashes";
import { enableMenus } from "./page/menus";
import { enableThemeToggle } from "./page/theme-toggle";

enableThemeToggle(document);
enableMenus(document);
enableDialogs(document);
enableCopying(document);
enableFlashes(document);
