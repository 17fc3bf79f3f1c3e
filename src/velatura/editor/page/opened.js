// States what to do where the page was opened as a file: browsers load no modules from files.

if (location.protocol === 'file:') {
  document.addEventListener('DOMContentLoaded', () => {
    const words = Object.assign(document.createElement('p'), {
      textContent:
        'The editor needs a web server, since browsers load no modules from files. Run "python -m http.server" in its folder, and open http://127.0.0.1:8000/.',
    });
    words.setAttribute('role', 'alert');
    document.body.replaceChildren(words);
  });
}
