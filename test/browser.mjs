// A real Chromium for tests in Python: reads a command a line from standard input, as JSON, and answers
// each with a line. See test/browser_testing.py.

import { createRequire } from 'node:module';
import { createInterface } from 'node:readline';

const [modules, executablePath] = process.argv.slice(2);
const { chromium } = createRequire(`${modules}/`)('playwright-core');
const PATIENCE_MS = 120000;
const FLAGS = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];

const browser = await chromium.launch({ executablePath, args: FLAGS });
const pages = [];

const commands = {
  async open({ url, width, height, touch }) {
    const context = await browser.newContext({ viewport: { width, height }, hasTouch: touch });
    const page = await context.newPage();
    page.setDefaultTimeout(PATIENCE_MS);
    page.faults = [];
    page.on('console', (message) => {
      if (['error', 'warning'].includes(message.type())) page.faults.push(message.text());
    });
    page.on('pageerror', (error) => page.faults.push(String(error.stack)));
    await page.goto(url);
    return pages.push(page) - 1;
  },
  run: ({ page, script }) => pages[page].evaluate(script),
  async wait({ page, script, timeout_s }) {
    // Not waitForFunction: the page's own security policy forbids it.
    const end = Date.now() + 1000 * timeout_s;
    while (!await pages[page].evaluate(script)) {
      if (Date.now() > end) throw new Error('waited too long');
      await new Promise((done) => setTimeout(done, 50));
    }
  },
  press: ({ page, key }) => pages[page].keyboard.press(key),
  click: ({ page, selector }) => pages[page].click(selector),
  tap: ({ page, selector }) => pages[page].tap(selector),
  fill: ({ page, selector, text }) => pages[page].fill(selector, text),
  async shot({ page, path }) { await pages[page].screenshot({ path }); },
  faults: ({ page }) => pages[page].faults.splice(0),
  close: ({ page }) => pages[page].context().close(),
};

for await (const line of createInterface({ input: process.stdin })) {
  const { command, ...values } = JSON.parse(line);
  let answer;
  try {
    answer = { value: (await commands[command](values)) ?? null };
  } catch (error) {
    answer = { error: String(error.message) };
  }
  console.log(JSON.stringify(answer));
}
await browser.close();
