// The page: it opens the bundle in the module, updates characters sixty times a second, draws them, and shows the table.

const MOST = 20, HALF_TURN = Math.PI

/** The module with a bundle opened for so many characters; throws with the reason where it is refused. */
export async function opened(module, bundle, n = MOST) {
  const imports = {}
  for (const each of WebAssembly.Module.imports(module)) (imports[each.module] ??= {})[each.name] = () => 0
  const { exports: core } = await WebAssembly.instantiate(module, imports)
  core._initialize?.()
  const at = (core.alloc(bundle.byteLength + 16) + 15) & ~15
  new Uint8Array(core.memory.buffer, at, bundle.byteLength).set(new Uint8Array(bundle))
  const why = core.open(at, bundle.byteLength, n)
  if (why) throw new Error(text(core, why))
  for (let i = 0; i < n; i++) core.begin(i, 1.5 * (i % 5), 1.5 * Math.floor(i / 5), 0)
  return core
}

/** A text of the module. */
export function text(core, at) {
  if (!at) return ''
  const bytes = new Uint8Array(core.memory.buffer)
  let end = at
  while (bytes[end]) end++
  return new TextDecoder().decode(bytes.subarray(at, end))
}

const numbers = (core, at, n) => new Float64Array(core.memory.buffer, at, n)

/** The number of a condition, -1 for none. */
export function conditionNumber(core, name) {
  for (let at = 0; at < core.n_conditions(); at++) if (text(core, core.condition(at)) === name) return at
  return -1
}

/** Steer a character: the stick is a velocity, m/s; the facts that follow from it are set. */
export function steer(core, i, x, z, isTired) {
  const speed = Math.hypot(x, z)
  core.steer(i, x, z)
  core.set_fact(i, conditionNumber(core, 'gait'), speed === 0 ? 0 : speed < 2.1 ? 1 : 2)
  core.set_fact(i, conditionNumber(core, 'style'), isTired ? 1 : 0)
}

/** What a cell accepts, in words. */
export function cellText(core, row, at) {
  const n = core.n_classes(at), accepted = []
  for (let k = 0; k < n; k++) if (core.accepts(row, at, k)) accepted.push(k)
  if (n === 0) return '…'
  if (accepted.length === n) return 'Any'
  if (accepted.length === 0) return 'none'
  if (text(core, core.class_name(at, 0))) return accepted.map(k => text(core, core.class_name(at, k))).join(' ')
  const parts = []
  for (const k of accepted) {
    if (parts.length && parts.at(-1)[1] === k - 1) parts.at(-1)[1] = k
    else parts.push([k, k])
  }
  const last = n - 1, isRound = parts.length > 1 && parts[0][0] === 0 && parts.at(-1)[1] === last && Math.round(core.bound(at, 0)) === -180
  if (isRound && parts[0][1] === 0) { // of an angle: 180 is -180
    parts.shift()
    return parts.map(([from, to]) => to === last ? `${span(core, at, from, to).replace('from ', '')} to 180` : span(core, at, from, to)).join(' or ')
  }
  return parts.map(([from, to]) => span(core, at, from, to)).join(' or ')
}

function span(core, at, from, to) {
  const low = from === 0 ? NaN : core.bound(at, from - 1), high = core.bound(at, to)
  const shown = number => String(Math.round(number * 100) / 100)
  if (Number.isNaN(low)) return Number.isNaN(high) ? 'Any' : `up to ${shown(high)}`
  return Number.isNaN(high) ? `from ${shown(low)}` : `${shown(low)} to ${shown(high)}`
}

const className = (core, at, k) => text(core, core.class_name(at, k)) || span(core, at, k, k)

// ---- in a browser

if (typeof document !== 'undefined') start().catch(error => { document.getElementById('say').textContent = `It cannot start: ${error.message}` })

/** A file beside the page, or in it. */
async function read(name) {
  const inside = document.getElementById(name)
  if (!inside) return (await fetch(name)).arrayBuffer()
  return Uint8Array.from(atob(inside.textContent), character => character.charCodeAt(0)).buffer
}

async function start() {
  const [module, bundle] = await Promise.all([read('motion.wasm').then(bytes => WebAssembly.compile(bytes)), read('game.motion')])
  const core = await opened(module, bundle)
  const page = { core, stick: location.hash === '#walk' ? [0.5, 1.3] : [0, 0], // a test opens it walking
    keys: new Set(), n: 1, isTired: false, ticks: 0, since: performance.now(), spent: 0 }
  listen(page)
  makeTable(page)
  let last = performance.now()
  const frame = now => {
    const dt = Math.min((now - last) / 1000, 0.1), began = performance.now()
    last = now
    update(page, dt)
    page.spent += performance.now() - began
    draw(page)
    requestAnimationFrame(frame)
  }
  requestAnimationFrame(frame)
  setInterval(() => showTable(page), 200)
}

function wanted(page) {
  const down = name => page.keys.has(name)
  const x = (down('a') || down('arrowleft') ? 1 : 0) - (down('d') || down('arrowright') ? 1 : 0)
  const z = (down('w') || down('arrowup') ? 1 : 0) - (down('s') || down('arrowdown') ? 1 : 0)
  if (!x && !z) return page.stick
  const speed = (down('shift') ? 3.2 : 1.4) / Math.hypot(x, z)
  return [speed * x, speed * z]
}

function update(page, dt) {
  const { core } = page, [x, z] = wanted(page)
  steer(core, 0, x, z, page.isTired)
  for (let i = 1; i < page.n; i++) { // the others walk in circles, each its own
    const turn = performance.now() / (4000 + 300 * i) + i
    steer(core, i, 1.4 * Math.sin(turn), 1.4 * Math.cos(turn), i % 3 === 0)
  }
  core.update(page.n, dt)
  page.ticks++
  const now = performance.now()
  if (now - page.since > 500) {
    const rate = page.ticks / (now - page.since) * 1000, each = page.spent / page.ticks
    document.getElementById('rate').textContent = `${rate.toFixed(0)} updates a second, ${each.toFixed(2)} ms each`
    page.ticks = page.spent = 0, page.since = now
  }
  document.getElementById('say').innerHTML = ''
  const say = document.getElementById('say'), name = document.createElement('b')
  name.textContent = text(core, core.asset(0)) || 'nothing'
  say.append(name, ` ${core.time_s(0).toFixed(2)} s: it ${text(core, core.action(0))}, as ${text(core, core.reason(0))}`)
}

function listen(page) {
  const view = document.getElementById('view')
  let from = null
  addEventListener('keydown', event => { if (!event.target.closest('dialog')) page.keys.add(event.key.toLowerCase()) })
  addEventListener('keyup', event => page.keys.delete(event.key.toLowerCase()))
  addEventListener('blur', () => page.keys.clear())
  view.addEventListener('pointerdown', event => { from = [event.clientX, event.clientY]; view.setPointerCapture(event.pointerId) })
  view.addEventListener('pointermove', event => {
    if (!from) return
    const x = (from[0] - event.clientX) / 60, z = (from[1] - event.clientY) / 60, length = Math.hypot(x, z)
    const speed = length < 0.15 ? 0 : length < 1.2 ? 1.4 : 3.2
    page.stick = speed ? [x * speed / length, z * speed / length] : [0, 0]
  })
  for (const end of ['pointerup', 'pointercancel']) view.addEventListener(end, () => { from = null; page.stick = [0, 0] })
  const toggle = (id, change) => document.getElementById(id).addEventListener('click', event => {
    const isOn = event.target.getAttribute('aria-pressed') !== 'true'
    event.target.setAttribute('aria-pressed', isOn)
    change(isOn)
  })
  toggle('tired', isOn => { page.isTired = isOn })
  toggle('crowd', isOn => { page.n = isOn ? MOST : 1 })
}

// ---- the table

function makeTable(page) {
  const { core } = page, head = document.querySelector('thead'), body = document.querySelector('tbody')
  const top = head.insertRow()
  for (let at = -1; at < core.n_conditions(); at++) top.insertAdjacentElement('beforeend', document.createElement('th')).textContent = at < 0 ? 'Asset' : text(core, core.condition(at))
  for (let row = 0; row < core.n_rows(); row++) {
    const line = body.insertRow()
    line.insertCell().textContent = text(core, core.row_asset(row))
    for (let at = 0; at < core.n_conditions(); at++) {
      const button = line.insertCell().appendChild(document.createElement('button'))
      button.addEventListener('click', () => editCell(page, row, at))
    }
  }
  showTable(page)
}

function showTable(page) {
  const { core } = page, playing = text(core, core.asset(0)), body = document.querySelector('tbody')
  let n = 0
  core.ask(0)
  for (const [row, line] of [...body.rows].entries()) {
    const isValid = core.is_valid(row) === 1, fails = new Set()
    n += isValid
    if (!isValid) for (let k = core.why_not(0, row); k-- > 0;) fails.add(core.why_not_condition(k))
    line.className = `${isValid ? 'valid' : ''} ${text(core, core.row_asset(row)) === playing ? 'plays' : ''}`
    for (let at = 0; at < core.n_conditions(); at++) {
      const cell = line.cells[at + 1], words = cellText(core, row, at)
      if (cell.firstChild.textContent !== words) cell.firstChild.textContent = words
      cell.className = fails.has(at) ? 'fails' : ''
    }
  }
  const facts = []
  for (let at = 0; at < core.n_conditions(); at++) {
    const fact = core.fact_number(0, at), value = text(core, core.class_name(at, fact))
    facts.push(`${text(core, core.condition(at))} ${value || (Math.round(fact * 10) / 10).toFixed(1)}`)
  }
  document.getElementById('why').textContent = `Now: ${facts.join(', ')}. ${n} of ${core.n_rows()} rows are valid; in the others, what is red does not hold.`
}

function editCell(page, row, at) {
  const { core } = page, dialog = document.getElementById('cell'), list = dialog.querySelector('div')
  dialog.querySelector('b').textContent = `${text(core, core.row_asset(row))}: ${text(core, core.condition(at))}`
  list.replaceChildren()
  for (let k = 0; k < core.n_classes(at); k++) {
    const label = list.appendChild(document.createElement('label')), box = label.appendChild(document.createElement('input'))
    box.type = 'checkbox'
    box.checked = core.accepts(row, at, k) === 1
    label.append(className(core, at, k))
    box.addEventListener('change', () => { core.accept(row, at, k, box.checked ? 1 : 0); showTable(page) })
  }
  dialog.showModal()
}

// ---- the picture: lines between joints, seen from behind and above

function draw(page) {
  const { core } = page, view = document.getElementById('view'), ratio = devicePixelRatio || 1
  const width = view.clientWidth, height = view.clientHeight
  if (view.width !== Math.round(width * ratio)) view.width = Math.round(width * ratio)
  if (view.height !== Math.round(height * ratio)) view.height = Math.round(height * ratio)
  const pen = view.getContext('2d'), ink = getComputedStyle(view).color, [cx, cz] = numbers(core, core.root(0), 2)
  pen.setTransform(ratio, 0, 0, ratio, 0, 0)
  pen.clearRect(0, 0, width, height)
  const lean = 0.42, back = 5.2, zoom = height * 1.15
  const seen = (x, y, z) => { // left is +x, ahead +z
    const right = cx - x, up = y - 0.9, away = z - cz, far = away * Math.cos(lean) - up * Math.sin(lean) + back
    return far > 0.3 ? [width / 2 + zoom * right / far, height / 2 - zoom * (up * Math.cos(lean) + away * Math.sin(lean)) / far, far] : null
  }
  const line = (a, b) => { if (a && b) { pen.beginPath(); pen.moveTo(a[0], a[1]); pen.lineTo(b[0], b[1]); pen.stroke() } }
  pen.strokeStyle = ink
  pen.globalAlpha = 0.18
  pen.lineWidth = 1
  for (let k = -8; k <= 8; k++) {
    const x = Math.round(cx) + k, z = Math.round(cz) + k
    line(seen(x, 0, cz - 3), seen(x, 0, cz + 9))
    line(seen(cx - 9, 0, z), seen(cx + 9, 0, z))
  }
  pen.lineCap = 'round'
  for (let i = page.n - 1; i >= 0; i--) {
    const joints = core.n_joints(), places = numbers(core, core.positions(i), 3 * joints)
    const points = Array.from({ length: joints }, (_, j) => seen(places[3 * j], places[3 * j + 1], places[3 * j + 2]))
    const [x, z, heading] = numbers(core, core.root(i), 3)
    pen.globalAlpha = i ? 0.55 : 1
    pen.strokeStyle = i ? ink : '#2a7de1'
    for (let j = 0; j < joints; j++) {
      const up = core.parent(j)
      if (up < 0 || !points[j]) continue
      pen.lineWidth = Math.max(1.5, 26 / points[j][2])
      line(points[up], points[j])
    }
    pen.lineWidth = 2
    pen.strokeStyle = '#e0632a'
    line(seen(x, 0.01, z), seen(x + 0.45 * Math.sin(heading), 0.01, z + 0.45 * Math.cos(heading)))
    if (i) continue
    const [wx, wz] = wanted(page)
    pen.strokeStyle = '#2a7'
    line(seen(x, 0.01, z), seen(x + 0.5 * wx, 0.01, z + 0.5 * wz))
  }
  pen.globalAlpha = 1
}
