// Files to and from the browser.

/** A file of the user's, or undefined where none is chosen; `element` is any that is shown. */
export function chooseFile(element, accept) {
  const input = element.ownerDocument.createElement('input');
  input.type = 'file';
  input.accept = accept;
  input.hidden = true;
  element.append(input);
  return new Promise((resolve) => {
    const done = () => {
      input.remove();
      resolve(input.files[0]);
    };
    input.addEventListener('change', done);
    input.addEventListener('cancel', done);
    input.click();
  });
}

/** Hands a file to the browser. */
export function offer(document, blob, name) {
  const { URL } = document.defaultView;
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
