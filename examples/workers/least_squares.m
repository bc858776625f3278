% A worker in Octave or MATLAB: least squares of A(q) y = B(q) u + e.
requests = fopen(getenv("ASOBENCH_REQUESTS"), "r", "ieee-le");
replies = fopen(getenv("ASOBENCH_REPLIES"), "w", "ieee-le");
while true
    line = '';  % not by fgetl, which waits for what comes after the line
    while isempty(line) || line(end) ~= 10
        byte = fread(requests, 1, "uint8");
        if isempty(byte), exit, end
        line(end + 1) = byte;
    end
    head = jsondecode(line);
    if strcmp(head.frame, "hello")
        hello = head;
        fprintf(replies, "%s\n", ['{"frame":"ready","protocol":1,"name":"least squares in Octave",' ...
            '"version":"1.0","returns":"polynomials","deterministic":true}']);
    else
        m = head.trials; N = head.samples; na = hello.na; nb = hello.nb; nk = hello.nk;
        numbers = fread(requests, 2*m, "double");
        u = fread(requests, [N, m], "double");
        y = fread(requests, [N, m], "double");
        r = fread(requests, [N, m], "double");
        theta = zeros(na + nb, m); status = zeros(m, 1);
        k = (max(na, nb + nk - 1) + 1 : N)';
        for i = 1:m
            ui = u(:, i); yi = y(:, i);
            phi = [reshape(-yi(k - (1:na)), [], na), reshape(ui(k - nk - (0:nb-1)), [], nb)];
            if all(isfinite([phi(:); yi])) && rank(phi) == na + nb
                theta(:, i) = phi \ yi(k);
            else
                status(i) = 2;
            end
        end
        fprintf(replies, '{"frame":"reply","number":%d,"trials":%d,"na":%d,"nb":%d,"nk":%d,"reasons":["no full rank"],"bytes":%d}\n', ...
            head.number, m, na, nb, nk, 8 * m * (2 + na + nb));
        fwrite(replies, [status; nan(m, 1); theta(:)], "double");
        fprintf(replies, "\n");
    end
    fflush(replies);
end
