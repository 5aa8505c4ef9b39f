// What a running game plays: the bones of each character come once, then its poses. docs/live.md says what the lines hold.

/** A vector turned by a rotation (w, x, y, z). */
export function turned([w, x, y, z], [a, b, c]) {
  const i = 2 * (y * c - z * b), j = 2 * (z * a - x * c), k = 2 * (x * b - y * a)
  return [a + w * i + y * k - z * j, b + w * j + z * i - x * k, c + w * k + x * j - y * i]
}

/** The rotation b, then a. */
export function after([w, x, y, z], [p, q, r, s]) {
  return [w * p - x * q - y * r - z * s, w * q + x * p + y * s - z * r, w * r - x * s + y * p + z * q, w * s + x * r - y * q + z * p]
}

/** Where each joint is in the world, in metres: x to the left, y up, z ahead of a heading of 0. */
export function places({ parents, offsets, moving }, { root: [x, z, heading], rotations, translations }) {
  const ground = [Math.cos(heading / 2), 0, Math.sin(heading / 2), 0], own = offsets.slice(), turns = [], found = []
  moving.forEach((joint, k) => { own[joint] = translations[k] })
  for (let joint = 0; joint < parents.length; joint++) { // parents come first
    const up = parents[joint], turn = up < 0 ? ground : turns[up], from = up < 0 ? [x, 0, z] : found[up]
    found.push(turned(turn, own[joint]).map((number, axis) => number + from[axis]))
    turns.push(after(turn, rotations[joint]))
  }
  return found
}

if (typeof document !== 'undefined') {
  const bones = new Map(), poses = new Map(), say = document.getElementById('say'), lines = new EventSource('lines')
  lines.onmessage = ({ data }) => {
    const line = JSON.parse(data)
    if (line.line === 'bones') bones.set(line.who, line)
    else poses.set(line.who, line)
  }
  lines.onerror = () => { if (!poses.size) say.textContent = 'No game publishes poses yet.' }
  const frame = () => { draw(bones, poses, say); requestAnimationFrame(frame) }
  requestAnimationFrame(frame)
}

/** All characters, seen from behind and above the first. */
function draw(bones, poses, say) {
  const view = document.getElementById('view'), pen = view.getContext('2d'), ratio = devicePixelRatio || 1
  const width = view.clientWidth, height = view.clientHeight, lean = 0.42, zoom = height * 1.15
  view.width = Math.round(width * ratio), view.height = Math.round(height * ratio)
  if (!poses.size) return
  const [first] = poses.values(), [cx, cz] = first.root
  pen.setTransform(ratio, 0, 0, ratio, 0, 0)
  const seen = ([x, y, z]) => {
    const up = y - 0.9, away = z - cz, far = away * Math.cos(lean) - up * Math.sin(lean) + 5.2
    return far > 0.3 && [width / 2 + zoom * (cx - x) / far, height / 2 - zoom * (up * Math.cos(lean) + away * Math.sin(lean)) / far, far]
  }
  const line = (a, b) => { if (a && b) { pen.beginPath(); pen.moveTo(a[0], a[1]); pen.lineTo(b[0], b[1]); pen.stroke() } }
  pen.strokeStyle = getComputedStyle(view).color, pen.globalAlpha = 0.18
  for (let k = -8; k <= 8; k++) {
    const x = Math.round(cx) + k, z = Math.round(cz) + k
    line(seen([x, 0, cz - 3]), seen([x, 0, cz + 9]))
    line(seen([cx - 9, 0, z]), seen([cx + 9, 0, z]))
  }
  pen.strokeStyle = '#2a7de1', pen.globalAlpha = 1, pen.lineCap = 'round'
  for (const [who, pose] of poses) {
    const of = bones.get(who)
    if (!of) continue
    const points = places(of, pose).map(seen)
    of.parents.forEach((up, joint) => {
      if (up < 0 || !points[joint]) return
      pen.lineWidth = Math.max(1.5, 26 / points[joint][2])
      line(points[up], points[joint])
    })
  }
  say.textContent = [...poses].map(([who, pose]) => `${who ?? 'somebody'} plays ${pose.asset ?? 'nothing'}`).join(', ')
}
