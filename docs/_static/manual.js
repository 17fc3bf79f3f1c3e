// What opens a part of the navigation has no name for screen readers in the theme.
addEventListener("DOMContentLoaded", () => {
  for (const summary of document.querySelectorAll("summary:has(.toctree-toggle)")) {
    summary.setAttribute("aria-label", "Pages of this part");
  }
});
