// figures open in full size; wide equations scroll, also by keyboard; toggles of the sidebar get names for screen readers
document.addEventListener("DOMContentLoaded", () => {
  for (const image of document.querySelectorAll('.bd-article img[src$=".svg"]')) {
    const link = document.createElement("a");
    link.href = image.src;
    link.className = "figure";
    link.title = "The figure in full size";
    link.setAttribute("aria-label", `${image.alt || "Figure"}, in full size`);
    image.replaceWith(link);
    link.append(image);
  }
  for (const equation of document.querySelectorAll("div.math")) {
    equation.tabIndex = 0;
  }
  for (const toggle of document.querySelectorAll(".bd-sidebar-primary summary")) {
    const link = toggle.closest("li").querySelector("a");
    toggle.setAttribute("aria-label", `Pages below ${link.textContent.trim()}`);
  }
});
