"use strict";
// Parts that every script of a page shares: elements, numbers in words, ticks of an axis.

const SVG = "http://www.w3.org/2000/svg";
const byId = (id) => document.getElementById(id);

function filled(made, parent, attributes, words) {
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (words !== null) made.textContent = words;
  parent.append(made);
  return made;
}

const element = (parent, name, attributes = {}, words = null) => filled(document.createElementNS(SVG, name), parent, attributes, words);
const node = (parent, name, attributes = {}, words = null) => filled(document.createElement(name), parent, attributes, words);

function text(value, decimals) {
  const plain = Math.abs(value).toFixed(decimals);
  return (value < 0 && Number(plain) !== 0 ? "−" : "") + plain;
}

function signed(value, decimals) {
  const words = text(value, decimals);
  return value > 0 && Number(words) !== 0 ? "+" + words : words;
}

function ticks(lower, upper, wanted) {
  const rough = (upper - lower) / wanted;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
  const values = [];
  for (let at = Math.ceil(lower / step - 1e-9); at * step <= upper + step * 1e-9; at++) values.push(at * step);
  return { values, decimals: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

function download(name, type, parts) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob(parts, { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
