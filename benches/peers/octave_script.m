% W98 (see workload.py) as a script for Octave, the kind of environment that the paper used: a loop over the trials.
%
% octave-cli octave_script.m [--trials M] [--seed S] [--start burn-in|stationary]
%
% The noise begins with 200 samples that are thrown away, or with an exact draw of its stationary distribution. Prints
% a line of JSON. Octave's own arithmetic uses one thread; set OPENBLAS_NUM_THREADS=1 for its BLAS.
1;

% The states of x(k+1) = A x(k) + b u(k) from x0, one column each.
function X = simulate(A, b, x0, u)
  X = zeros(rows(A), numel(u));
  x = x0;
  for k = 1:numel(u)
    X(:, k) = x;
    x = A * x + b * u(k);
  end
end

function A = companion(a)
  n = numel(a);
  A = [zeros(n - 1, 1), eye(n - 1); a'];
end

% The Toeplitz block with the rows s(k-1), ..., s(k-n), k = n, ..., N-1.
function M = lagged(s, n, N)
  M = toeplitz(s(n:N-1), s(n:-1:1));
end

% p of G p = r by the partitioned inverse (stages 3, 4, 10).
function p = solve_partitioned(G, r)
  n = rows(G) / 2;
  i = 1:n;
  j = n+1:2*n;
  M1 = inv(G(i, i));
  M2 = inv(G(j, j) - G(j, i) * M1 * G(i, j));
  P = M1 * G(i, j) * M2;
  Q = M2 * G(j, i) * M1;
  p = [M1 + P * G(j, i) * M1, -P; -Q, M2] * r;
end

% a from p, and b from T b = h (stages 4, 5).
function [a, b] = parameters(p)
  n = numel(p) / 2;
  a = -p(n:-1:1);
  T = toeplitz([1; -a(n:-1:2)], [1, zeros(1, n - 1)]);
  b = T \ p(n+1:end);
end

% x0 from the output less the zero-state response, by the normal equations (stage 6).
function x0 = initial_state(a, b, y, u)
  n = numel(a);
  A = companion(a);
  D = zeros(numel(y), n);
  row = [1, zeros(1, n - 1)];
  for k = 1:numel(y)
    D(k, :) = row;
    row = row * A;
  end
  response = simulate(A, b, zeros(n, 1), u)(1, :)';
  x0 = (D' * D) \ (D' * (y - response));
end

% a, b and x0 after the last pass (stages 1 to 11); y and u are the window's.
function [a, b, x0] = estimate(y, u, n, passes)
  N = numel(y);
  U = lagged(u, n, N);
  Phi = [-lagged(y, n, N), U];
  target = y(n+1:N);
  Z = Phi;
  for i = 0:passes
    if i > 0
      auxiliary = simulate(companion(a), b, x0, u)(1, :)';
      Z = [-lagged(auxiliary, n, N), U];
    end
    [a, b] = parameters(solve_partitioned(Z' * Phi, Z' * target));
    x0 = initial_state(a, b, y, u);
  end
end

% White noise through 1/A(q). `factor` is empty for a burn-in of 200 samples, else L with L L' the stationary covariance
% of (f(k-n), ..., f(k-1)), from which the filter's own state follows.
function f = noise(a, K, factor)
  denominator = [1; -flipud(a)];
  if isempty(factor)
    f = filter(1, denominator, randn(200 + K, 1))(201:end);
  else
    past = flipud(factor * randn(numel(a), 1));
    f = filter(1, denominator, randn(K, 1), -hankel(denominator(2:end)) * past);
  end
end

function L = stationary_factor(a)
  n = numel(a);
  F = companion(a);
  e = [zeros(n - 1, 1); 1];
  P = reshape((eye(n^2) - kron(F, F)) \ (e * e')(:), n, n);
  L = chol(P, 'lower');
end

% e_a, e_b and max e_x of one trial.
function errors = trial(factor)
  N = 98;
  K = 400;
  a_true = [-0.00009, 0.002835, -0.035525, 0.2275, -0.7875, 1.4]';
  b_true = [0.6, 0.2, 0.1, 0.3, 0.4, 0.5]';
  n = numel(a_true);
  u = 10 * sign(rand(K, 1) - 0.5);
  X = simulate(companion(a_true), b_true, ones(n, 1), u);
  output = X(1, :)';
  f = noise(a_true, K, factor);
  y = output + f * (0.10018 * std(output(1:N)) / std(f(1:N)));

  [a, b, x] = estimate(y(1:N), u(1:N), n, 4);

  % Stage 12: g = A^n e_n, Ackermann's formula, where the observability matrix is I.
  A = companion(a);
  gain = A^n * [zeros(n - 1, 1); 1];
  worst = 0;
  for k = 1:K
    if k > N
      worst = max(worst, norm(X(:, k) - x) / norm(X(:, k)));
    end
    x = A * x + b * u(k) + gain * (y(k) - x(1));
  end
  errors = [norm(a - a_true) / norm(a_true), norm(b - b_true) / norm(b_true), worst];
end

% The medians and their standard errors, from the order statistics that bound them with 95 % (ranks M/2 +- 0.98 sqrt M):
% their distance over 2 * 1.96.
function [m, se] = median_and_error(values)
  ordered = sort(values);
  count = rows(ordered);
  reach = 0.98 * sqrt(count);
  low = max(floor(count / 2 - reach), 0) + 1;
  high = min(ceil(count / 2 + reach), count - 1) + 1;
  m = median(ordered, 1);
  se = (ordered(high, :) - ordered(low, :)) / (2 * 1.96);
end

function fail(message)
  fprintf(stderr, 'octave_script.m: %s\n', message);
  exit(2);
end

trials = 200;
seed = 1;
start = 'burn-in';
given = argv();
for i = 1:2:numel(given)
  if i == numel(given)
    fail([given{i}, ' needs a value']);
  end
  value = given{i+1};
  switch given{i}
    case '--trials'
      trials = str2double(value);
    case '--seed'
      seed = str2double(value);
    case '--start'
      start = value;
    otherwise
      fail(['unknown option ', given{i}]);
  end
end
if ! (trials >= 1 && trials == fix(trials))
  fail('--trials must be a whole number, at least 1');
elseif ! (seed >= 0 && seed == fix(seed))
  fail('--seed must be a whole number, at least 0');
elseif ! any(strcmp(start, {'burn-in', 'stationary'}))
  fail('--start must be burn-in or stationary');
end

% An unstable estimate may leave a singular matrix: a failed trial, not a warning.
warning('off', 'Octave:singular-matrix');
warning('off', 'Octave:nearly-singular-matrix');
rand('twister', seed);
randn('twister', seed);
factor = [];
if strcmp(start, 'stationary')
  factor = stationary_factor([-0.00009, 0.002835, -0.035525, 0.2275, -0.7875, 1.4]');
end
errors = zeros(trials, 3);
clock = tic;
for s = 1:trials
  errors(s, :) = trial(factor);
end
seconds = toc(clock);

finite = errors(all(isfinite(errors), 2), :);
[m, se] = median_and_error(finite);
printf(['{"tool": "octave", "version": "%s", "threads": 1, "start": "%s", "seed": %d, "trials": %d, "failed": %d, ' ...
        '"seconds": %.9g, "trials_per_second": %.9g, "e_a": %.15g, "e_a_se": %.6g, "e_b": %.15g, "e_b_se": %.6g, ' ...
        '"e_x_max": %.15g, "e_x_max_se": %.6g}\n'], version(), start, seed, trials, trials - rows(finite), seconds, ...
       trials / seconds, [m; se](:));
