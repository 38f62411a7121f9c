/* FMI's headers include it without need; WebAssembly on its own has none. */
