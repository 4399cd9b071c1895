// Says in the page what is missing while it still loads. A module cannot: it never runs where a file that it needs is absent.
"use strict";
{
  const isOnDisk = location.protocol === "file:";
  const fromDisk = "browsers load modules from a web server only. Run `python -m http.server` in the site's folder and open http://localhost:8000/.";
  const say = (text) => {
    if (document.readyState === "loading") return addEventListener("DOMContentLoaded", () => say(text));
    const status = document.querySelector('[role="status"]');
    document.body.dataset.link = "gone"; // a page may show its status only then
    if (status.textContent.startsWith("Loading")) status.textContent = `This page cannot start: ${text}`;
  };
  const explain = ({ message, reason }) => {
    const gone = performance.getEntriesByType("resource").filter(({ responseStatus }) => responseStatus >= 400);
    const names = gone.map(({ name }) => decodeURI(new URL(name).pathname).split("/").slice(-2).join("/"));
    const missing = names.length ? `${names.join(", ")} is not on this host` : (message ?? reason?.message ?? "a script did not load");
    say(isOnDisk ? fromDisk : `${missing}. Upload the whole folder.`);
  };
  addEventListener("error", explain, true); // of a script, and thrown in one
  addEventListener("unhandledrejection", explain);
}
