// wide equations scroll, also by keyboard; toggles of the sidebar get names for screen readers
document.addEventListener("DOMContentLoaded", () => {
  for (const equation of document.querySelectorAll("div.math")) {
    equation.tabIndex = 0;
  }
  for (const toggle of document.querySelectorAll(".bd-sidebar-primary summary")) {
    const link = toggle.closest("li").querySelector("a");
    toggle.setAttribute("aria-label", `Pages below ${link.textContent.trim()}`);
  }
});
