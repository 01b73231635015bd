# The population of a folder written by `palpate population --out`, found again from its sessions.csv with nothing but matrices:
# the restricted likelihood of all values at once (Searle, Casella & McCulloch, Variance Components, 1992, section 6.6), whose
# covariance is that of the sessions and a sum over the levels. Printed as JSON: effects, standard errors and standard
# deviations in the order of effects.csv and deviations.csv.
suppressMessages(library(jsonlite))
folder <- commandArgs(trailingOnly = TRUE)[1]
sessions <- read.csv(file.path(folder, "sessions.csv"), check.names = FALSE)
names <- colnames(sessions)
logs <- grep("^log ", names)
first <- which(names == "mean")
parameters <- sub("^log ", "", names[logs])
effects <- names[first:(logs[1] - 1)]
outer_levels <- names[seq_len(first - 2) + 1]
count <- length(parameters)
rows <- nrow(sessions)

# All parameters of a session are next to each other, and all parameters of an effect.
values <- as.vector(t(as.matrix(sessions[logs])))
design <- kronecker(as.matrix(sessions[effects]), diag(count))
known <- matrix(0, rows * count, rows * count)
for (row in seq_len(rows)) for (a in seq_len(count)) for (b in seq_len(a)) {
    at <- (row - 1) * count + c(a, b)
    known[at[1], at[2]] <- known[at[2], at[1]] <- sessions[row, paste("cov", parameters[a], parameters[b])]
}
# Which sessions share a group of each level, the last of which are the sessions themselves.
paths <- lapply(seq_along(outer_levels), function(k) do.call(paste, c(sessions[outer_levels[seq_len(k)]], sep = " / ")))
shared <- lapply(c(paths, list(seq_len(rows))), function(path) outer(path, path, "==") * 1)

covariance <- function(deviations) {
    sum <- known
    for (level in seq_along(shared)) {
        own <- deviations[(level - 1) * count + seq_len(count)]
        sum <- sum + kronecker(shared[[level]], diag(own^2, count))
    }
    sum
}
found <- function(deviations) {
    root <- chol(covariance(deviations))
    x <- backsolve(root, design, transpose = TRUE)
    y <- backsolve(root, values, transpose = TRUE)
    information <- crossprod(x)
    beta <- solve(information, crossprod(x, y))
    criterion <- 2 * sum(log(diag(root))) + as.numeric(determinant(information)$modulus) + sum((y - x %*% beta)^2)
    list(criterion = criterion, effects = as.vector(beta), errors = sqrt(diag(solve(information))))
}
scatter <- apply(sessions[logs], 2, sd)
start <- rep(scatter / sqrt(length(shared)), length(shared))
fit <- nlminb(start, function(at) found(at)$criterion, lower = 0,
              control = list(rel.tol = 1e-14, x.tol = 1e-10, eval.max = 1e5, iter.max = 1e4))
best <- found(fit$par)
cat(toJSON(list(effects = best$effects, errors = best$errors, deviations = fit$par), digits = NA))
