from ._study import main

main()
