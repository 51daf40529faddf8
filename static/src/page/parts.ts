/**
 * The parts of a page that an island fills: marked with data-part in the template. A missing part
 * is a fault of the template, so it is named instead of being passed over.
 */
export function part(root: ParentNode, name: string): HTMLElement {
  const element = root.querySelector<HTMLElement>(`[data-part="${name}"]`);
  if (element === null) {
    throw new Error(`The template lacks data-part="${name}".`);
  }
  return element;
}

/** A copy of what stands in a <template data-name="...">. */
export function copyOf(root: ParentNode, name: string): DocumentFragment {
  const template = root.querySelector<HTMLTemplateElement>(`template[data-name="${name}"]`);
  if (template === null) {
    throw new Error(`The template lacks <template data-name="${name}">.`);
  }
  return template.content.cloneNode(true) as DocumentFragment;
}

/** An element with a class and text. */
export function element<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  className = "",
  text = "",
): HTMLElementTagNameMap[Tag] {
  const made = document.createElement(tag);
  made.className = className;
  made.textContent = text;
  return made;
}
