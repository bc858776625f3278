# A worker in R without any package: least squares of A(q) y = B(q) u + e.
requests <- file(Sys.getenv("ASOBENCH_REQUESTS"), "rb", raw = TRUE)
replies <- file(Sys.getenv("ASOBENCH_REPLIES"), "wb", raw = TRUE)
line <- function() {
  bytes <- raw(0)
  repeat {
    byte <- readBin(requests, "raw", 1)
    if (length(byte) == 0) return(NULL)
    if (byte == as.raw(10)) return(rawToChar(bytes))
    bytes <- c(bytes, byte)
  }
}
number <- function(head, key) as.numeric(sub(sprintf('.*"%s":([0-9]+).*', key), "\\1", head))
doubles <- function(count) readBin(requests, "double", count, endian = "little")
while (!is.null(head <- line())) {
  if (grepl('"frame":"hello"', head)) {
    na <- number(head, "na"); nb <- number(head, "nb"); nk <- number(head, "nk")
    writeBin(charToRaw(paste0('{"frame":"ready","protocol":1,"name":"least squares in R","version":"1.0",',
                              '"returns":"polynomials","deterministic":true}\n')), replies)
  } else {
    m <- number(head, "trials"); N <- number(head, "samples")
    ids <- doubles(2 * m)
    u <- matrix(doubles(m * N), N); y <- matrix(doubles(m * N), N); r <- matrix(doubles(m * N), N)
    k <- (max(na, nb + nk - 1) + 1):N
    theta <- sapply(1:m, function(i) {
      phi <- cbind(-outer(k, 1:na, function(k, j) y[k - j, i]), outer(k, 0:(nb - 1), function(k, j) u[k - nk - j, i]))
      tryCatch(c(0, qr.solve(phi, y[k, i], tol = 1e-13)), error = function(e) c(2, rep(0, na + nb)))
    })
    blocks <- c(theta[1, ], rep(NaN, m), theta[-1, ])
    head <- sprintf('{"frame":"reply","number":%d,"trials":%d,"na":%d,"nb":%d,"nk":%d,"reasons":["no full rank"],"bytes":%d}\n',
                    number(head, "number"), m, na, nb, nk, 8 * length(blocks))
    writeBin(c(charToRaw(head), writeBin(blocks, raw(), endian = "little"), as.raw(10)), replies)
  }
  flush(replies)
}
