# Designs of nested studies with the answers of lme4, nlme and metafor, as JSON: public data of lme4 and nlme, and drawn
# studies that are unbalanced. `population-oracle` compares them with the crate.
suppressMessages({library(lme4); library(nlme); library(metafor); library(jsonlite)})
options(contrasts = c("contr.treatment", "contr.treatment"))

from_nlme <- c("Oats", "Machines", "Rail", "ergoStool", "Alfalfa", "Orthodont")
data(list = from_nlme, package = "nlme")
data(list = c("Pastes", "Dyestuff2", "cake", "sleepstudy"), package = "lme4")

# lme4 searches without derivatives: until the region in which it looks is so small.
tight <- lmerControl(optimizer = "bobyqa", optCtrl = list(rhoend = 1e-10, maxfun = 1e6),
                     check.conv.singular = "ignore")
lme_tight <- lmeControl(tolerance = 1e-12, msTol = 1e-12, msMaxIter = 1000, maxIter = 1000, opt = "nlminb")

design <- function(name, data, response, fixed, groups) {
    data <- as.data.frame(data)
    for (group in groups) data[[group]] <- as.character(data[[group]])
    # lme4 and nlme nest by names of their own.
    nest <- paste(groups, collapse = "/")
    lmer_fit <- lmer(as.formula(paste(response, "~", fixed, "+ (1 |", nest, ")")), data, control = tight)
    lme_fit <- tryCatch(lme(as.formula(paste(response, "~", fixed)), data,
                            random = as.formula(paste("~ 1 |", nest)), control = lme_tight),
                        error = function(why) NULL)
    x <- model.matrix(as.formula(paste("~", fixed)), data)
    spreads <- as.data.frame(VarCorr(lmer_fit))$sdcor
    # lme4 lists the innermost group first and the residual last.
    count <- length(groups)
    spreads <- c(rev(spreads[seq_len(count)]), spreads[count + 1])
    list(name = name, levels = c(groups, "residual"), effects = colnames(x),
         groups = unname(as.matrix(data[groups])), design = unname(x), values = data[[response]],
         lme4 = list(effects = unname(fixef(lmer_fit)), errors = unname(sqrt(diag(as.matrix(vcov(lmer_fit))))),
                     spreads = spreads),
         nlme = if (is.null(lme_fit)) NULL else
             list(effects = unname(fixef(lme_fit)), errors = unname(sqrt(diag(lme_fit$varFix))),
                  spreads = nlme_spreads(lme_fit)))
}

# Standard deviations, the outermost level first, then the residual.
nlme_spreads <- function(fit) {
    c(level_spreads(fit), fit$sigma)
}

# nlme lists the innermost level first.
level_spreads <- function(fit) {
    levels <- lapply(rev(fit$modelStruct$reStruct), function(one) sqrt(diag(as.matrix(one))) * fit$sigma)
    unlist(levels, use.names = FALSE)
}

set.seed(20)
drawn <- function(animals, sites_max, repeats_max, spreads) {
    rows <- list()
    for (a in seq_len(animals)) {
        shift_a <- rnorm(1, 0, spreads[1])
        for (s in seq_len(sample(sites_max, 1))) {
            shift_s <- shift_a + rnorm(1, 0, spreads[2])
            for (r in seq_len(sample(repeats_max, 1)))
                rows[[length(rows) + 1]] <- data.frame(
                    animal = paste0("a", a), site = paste0("s", s), treated = a %% 2, age = 1 + (a * 7) %% 5,
                    depth = s * 0.5, value = 2 + 0.3 * (a %% 2) + shift_s + rnorm(1, 0, spreads[3]))
        }
    }
    do.call(rbind, rows)
}

known <- function(name, data, fixed) {
    variance <- runif(nrow(data), 0.001, 0.2)
    data$value <- data$value + rnorm(nrow(data), 0, sqrt(variance))
    data$row <- seq_len(nrow(data))
    fit <- rma.mv(value, variance, mods = as.formula(paste("~", fixed)), random = ~ 1 | animal/site/row, data = data,
                  control = list(optimizer = "nlminb", rel.tol = 1e-10, iter.max = 1000, eval.max = 10000))
    x <- model.matrix(as.formula(paste("~", fixed)), data)
    list(name = name, levels = c("animal", "site", "residual"), effects = colnames(x),
         groups = unname(as.matrix(data[c("animal", "site")])), design = unname(x), values = data$value,
         variances = variance,
         metafor = list(effects = unname(c(coef(fit))), errors = unname(fit$se), spreads = sqrt(fit$sigma2)))
}

# The force of a standard linear solid (prony-1) whose indenter goes in at 1.5 mm/s for 4 s and stays: the logarithms of
# k_0, k_1 and tau_1.
speed_mm_s <- 1.5; ramp_s <- 4
relaxation <- function(t, k0, k1, tau) {
    ramp <- pmin(t, ramp_s)
    exp(k0) * speed_mm_s * ramp + exp(k1 + tau) * speed_mm_s * (exp(-(t - ramp) / exp(tau)) - exp(-t / exp(tau)))
}
medians <- log(c(0.05, 0.08, 3))

# The restricted likelihood of curves by Lindstrom & Bates (Biometrics 46 (1990) 673): lme of the curves made linear around the
# parameters that it finds of each, in turn until these stay. nlme() makes the same turns, but its standard deviations are those
# of maximum likelihood with method = "REML" too: of eight animals smaller by the root of 7 / 8.
restricted_curves <- function(data, levels, fixed) {
    curve <- interaction(data[levels], drop = TRUE)
    parts <- c("g_k0", "g_k1", "g_tau")
    slopes <- as.formula(paste("~ 0 +", paste(parts, collapse = " + ")))
    by_level <- sapply(levels, function(level) pdDiag(slopes), simplify = FALSE)
    terms <- c(parts, if (fixed != "1") paste0(parts, ":", fixed))
    at <- matrix(medians, nlevels(curve), 3, byrow = TRUE, dimnames = list(levels(curve), NULL))
    for (turn in 1:100) {
        own <- at[curve, ]
        up <- pmin(data$t, ramp_s)
        tau <- exp(own[, 3])
        after <- exp(-(data$t - up) / tau); all <- exp(-data$t / tau)
        data$g_k0 <- exp(own[, 1]) * speed_mm_s * up
        data$g_k1 <- exp(own[, 2]) * tau * speed_mm_s * (after - all)
        data$g_tau <- data$g_k1 + exp(own[, 2]) * speed_mm_s * ((data$t - up) * after - data$t * all)
        data$linear <- data$force - data$g_k0 - data$g_k1 + rowSums(data[parts] * own)
        fit <- lme(as.formula(paste("linear ~ 0 +", paste(terms, collapse = " + "))), data, random = by_level,
                   control = lmeControl(opt = "nlminb", msMaxIter = 1000, maxIter = 1000, msTol = 1e-10, tolerance = 1e-10))
        found <- as.matrix(coef(fit))
        # A row for each curve, by the path of its groups.
        found <- found[match(levels(curve), sapply(strsplit(rownames(found), "/"), paste, collapse = ".")), ]
        design <- data[match(levels(curve), curve), ]
        found <- found[, 1:3] + if (fixed != "1") found[, 4:6] * design[[fixed]] else 0
        change <- max(abs(found - at))
        at[] <- found
        if (change < 1e-5) return(fit)
    }
    stop("the curves still move")
}

# Curves of one specimen or more of each animal and one press or more of each; `spreads` has a row for each level.
# The answers may differ by `limit`.
curves <- function(name, animals, specimens, presses, spreads, noise, fixed = "1", effect = 0, limit = 0.01) {
    set.seed(20)
    levels <- c("animal", "specimen", "press")[seq_len(nrow(spreads))]
    rows <- list()
    for (a in seq_len(animals)) {
        of_animal <- medians + effect * (a %% 2) + rnorm(3, 0, spreads[1, ])
        for (s in seq_len(specimens)) {
            of_specimen <- of_animal + rnorm(3, 0, spreads[2, ])
            for (p in seq_len(presses)) {
                own <- of_specimen + if (nrow(spreads) > 2) rnorm(3, 0, spreads[3, ]) else 0
                t <- seq(0, by = 0.2, length.out = 80 + 20 * ((a + s + p) %% 3))
                rows[[length(rows) + 1]] <- data.frame(
                    animal = paste0("a", a), specimen = paste0("s", s), press = paste0("p", p), treated = a %% 2, t = t,
                    force = relaxation(t, own[1], own[2], own[3]) + rnorm(length(t), 0, noise))
            }
        }
    }
    data <- do.call(rbind, rows)
    fit <- restricted_curves(data, levels, fixed)
    design_of <- function(one) model.matrix(as.formula(paste("~", fixed)), one)[1, , drop = FALSE]
    list(name = name, limit = limit, family = "prony-1", levels = levels, parameters = c("k_0", "k_1", "tau_1"), effects = colnames(design_of(rows[[1]])),
         curves = lapply(rows, function(one) list(
             groups = as.character(one[1, levels[-length(levels)]]),
             design = c(design_of(one)),
             t_s = one$t, depth_mm = speed_mm_s * pmin(one$t, ramp_s), force_n = one$force)),
         nlme = list(effects = unname(fixef(fit)), errors = unname(sqrt(diag(fit$varFix))), spreads = level_spreads(fit)))
}

spreads <- rbind(c(0.25, 0.3, 0.2), c(0.15, 0.12, 0.15), c(0.08, 0.1, 0.12))
designs <- list(
    design("Oats", Oats, "yield", "nitro", c("Block", "Variety")),
    design("Machines, every seventh row left out", as.data.frame(Machines)[-seq(1, 54, 7), ], "score", "Machine", c("Worker")),
    design("Machines", Machines, "score", "1", c("Machine", "Worker")),
    design("Rail", Rail, "travel", "1", "Rail"),
    design("ergoStool", ergoStool, "effort", "Type", "Subject"),
    design("Alfalfa", Alfalfa, "Yield", "Date", c("Block", "Variety")),
    design("Orthodont", Orthodont, "distance", "age * Sex", "Subject"),
    design("Pastes", Pastes, "strength", "1", c("batch", "cask")),
    design("Dyestuff2, a spread of zero", Dyestuff2, "Yield", "1", "Batch"),
    design("cake", cake, "angle", "recipe + temp", c("replicate")),
    design("sleepstudy", sleepstudy, "Reaction", "Days", "Subject"),
    design("drawn, unbalanced", drawn(9, 4, 5, c(0.3, 0.2, 0.1)), "value", "treated + depth", c("animal", "site")),
    design("drawn, animals far apart", drawn(6, 5, 3, c(3, 0.2, 0.05)), "value", "treated + age", c("animal", "site")),
    known("drawn, known errors", drawn(10, 4, 4, c(0.3, 0.2, 0.1)), "treated"),
    known("drawn, known errors and two effects", drawn(14, 4, 4, c(0.5, 0.3, 0.2)), "treated + depth"),
    curves("curves", 8, 4, 1, spreads[1:2, ], 0.005),
    # The scatter of one curve, which counts here, is known to a few percent, and the noise is as large as differences of tau_1.
    curves("curves with much noise", 8, 4, 1, spreads[1:2, ], 0.03, limit = 0.03),
    curves("curves, an effect", 12, 3, 1, spreads[1:2, ], 0.01, "treated", c(0.3, 0.2, 0)),
    curves("curves of repeated presses", 8, 3, 3, spreads, 0.01),
    curves("curves, three animals", 3, 2, 1, spreads[1:2, ], 0.01))
cat(toJSON(designs, digits = NA, auto_unbox = FALSE))
