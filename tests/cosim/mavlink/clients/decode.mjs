// Run by the tests where node-mavlink is installed: decodes the frames of a .tlog and prints a JSON object.
//
//     node decode.mjs FILE.tlog

import { createRequire } from 'node:module'
import { readFileSync } from 'node:fs'
import { Readable } from 'node:stream'
import { join } from 'node:path'

const require = createRequire(join(process.cwd(), 'package.json'))
const { MavLinkPacketSplitter, MavLinkPacketParser, minimal, common, standard, ardupilotmega, development } =
  require('node-mavlink')

const registry = {
  ...minimal?.REGISTRY, ...common.REGISTRY, ...standard?.REGISTRY, ...ardupilotmega.REGISTRY, ...development?.REGISTRY,
}

const log = readFileSync(process.argv[2])
const frames = []
for (let at = 8; at < log.length;) {
  const length = log[at + 1] + 12 + (log[at + 2] & 1 ? 13 : 0)
  frames.push(log.subarray(at, at + length))
  at += length + 8
}

const splitter = new MavLinkPacketSplitter()
const parser = splitter.pipe(new MavLinkPacketParser())
const counts = {}
let decoded = 0
let numbers = 0
parser.on('data', packet => {
  const kind = registry[packet.header.msgid]
  if (!kind) return
  const data = packet.protocol.data(packet.payload, kind)
  decoded += 1
  numbers += Object.values(data).filter(value => typeof value === 'number').length
  counts[kind.MSG_NAME] = (counts[kind.MSG_NAME] || 0) + 1
})
parser.on('end', () => {
  console.log(JSON.stringify({
    frames: frames.length, decoded, numbers, counts,
    valid: splitter.validPackages, invalid: splitter.invalidPackages, unknown: splitter.unknownPackagesCount,
  }))
})
Readable.from(frames).pipe(splitter)
