"use strict";
{
  const data = JSON.parse(document.getElementById("data").textContent);
  const hours = document.getElementById("hours");
  const wiper = document.getElementById("wiper");
  const wipe = document.getElementById("wipe");
  const marker = document.getElementById("marker");
  const frames = new Map();
  for (const image of document.querySelectorAll("#frames img[data-kind]")) {
    const { mode, hours: hour, kind } = image.dataset;
    frames.set([mode, Number(hour), kind].join(), image);
  }

  const unaged = document.getElementById("unaged");
  const show = (id, frame = unaged) => {
    const image = document.getElementById(id);
    image.src = frame.src;
    image.alt = frame.alt;
  };

  const scene = () => {
    const mode = document.querySelector("input[name=mode]:checked").value;
    const place = Number(hours.value);
    const hour = data.hours[place];
    show("aged", frames.get([mode, hour, "picture"].join()));
    show("map", frames.get([mode, hour, "map"].join()));
    document.getElementById("hours-now").textContent = data.hour_names[place];
    hours.setAttribute("aria-valuetext", data.hour_names[place]);
    for (const [key, text] of Object.entries(data.shown[mode][place])) {
      document.getElementById("number-" + key).textContent = text;
    }
    const { left, across, last } = marker.dataset;
    const x = Number(left) + (Number(across) * hour) / Number(last);
    marker.setAttribute("transform", `translate(${x.toFixed(2)} 0)`);
  };

  const cut = () => wipe.style.setProperty("--cut", wiper.value + "%");

  const drag = (event) => {
    const { left, width } = wipe.getBoundingClientRect();
    wiper.value = Math.round((100 * (event.clientX - left)) / width);
    cut();
  };

  hours.addEventListener("input", scene);
  for (const radio of document.querySelectorAll("input[name=mode]")) radio.addEventListener("change", scene);
  wiper.addEventListener("input", cut);
  wipe.addEventListener("pointerdown", (event) => {
    wipe.setPointerCapture(event.pointerId);
    wiper.focus({ preventScroll: true, focusVisible: false });
    event.preventDefault();
    drag(event);
  });
  wipe.addEventListener("pointermove", (event) => {
    if (wipe.hasPointerCapture(event.pointerId)) drag(event);
  });
  show("before");
  scene();
  cut();
}
